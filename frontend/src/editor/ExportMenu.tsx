import { Button, Menu } from "@mantine/core";
import { useState } from "react";

import { api } from "../api/client";
import { ExportDialog } from "../exchange/ExportDialog";
import { type Format, FORMATS } from "../exchange/formats";
import { IconDown } from "../ui/icons";

const DIALOGS: Format[] = ["openscenario", "sumo"];

/** The formats that the scenario can be taken away in, in the head of the page. */
export function ExportMenu({ name }: { name: string }) {
  const [format, setFormat] = useState<Format | null>(null);
  return (
    <>
      <Menu position="bottom-end" withinPortal={false} withInitialFocusPlaceholder={false}>
        <Menu.Target>
          <Button variant="default" leftSection={<IconDown size={15} />}>
            Export
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          {DIALOGS.map((one) => (
            <Menu.Item key={one} onClick={() => setFormat(one)}>
              {FORMATS[one].title} …
            </Menu.Item>
          ))}
          <Menu.Divider />
          <Menu.Item component="a" href={api.downloadUrl(name, "json")} download>
            Document (JSON)
          </Menu.Item>
          <Menu.Item component="a" href={api.downloadUrl(name, "graphml")} download>
            Graph (GraphML)
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      {format && <ExportDialog name={name} format={format} onClose={() => setFormat(null)} />}
    </>
  );
}
