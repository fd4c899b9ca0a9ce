import { Button, Menu } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useState } from "react";

import { api } from "../api/client";
import { exchange, type Format } from "../api/exchange";
import { ExportDialog } from "../exchange/ExportDialog";
import { takesScenarios } from "../exchange/formats";
import { IconDown } from "../ui/icons";
import { useLoaded } from "../ui/useLoaded";
import { copyLink, savePicture, saveVector } from "../ui/share";

/** The formats that the scenario can be taken away in, in the head of the page. */
export function ExportMenu({
  name,
  onPicture,
  onVector,
}: {
  name: string;
  /** What the map shows now. */
  onPicture: () => HTMLCanvasElement | null;
  /** The same as SVG. */
  onVector: () => string | null;
}) {
  const [format, setFormat] = useState<Format | null>(null);
  const { value } = useLoaded(exchange.formats);
  return (
    <>
      <Menu position="bottom-end" withinPortal={false} withInitialFocusPlaceholder={false}>
        <Menu.Target>
          <Button variant="default" leftSection={<IconDown size={15} />} aria-label={t`Export`}>
            <span className="wide-word">
              <Trans>Export</Trans>
            </span>
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          {(value ?? []).filter(takesScenarios).map((one) => (
            <Menu.Item key={one.id} onClick={() => setFormat(one)}>
              {one.title} …
            </Menu.Item>
          ))}
          <Menu.Divider />
          <Menu.Item component="a" href={api.downloadUrl(name, "json")} download>
            <Trans>Document (JSON)</Trans>
          </Menu.Item>
          <Menu.Divider />
          <Menu.Item onClick={copyLink}>
            <Trans>Copy the link to this view</Trans>
          </Menu.Item>
          <Menu.Item
            onClick={() => {
              const canvas = onPicture();
              if (canvas) savePicture(canvas, name);
            }}
          >
            <Trans>Picture of the map (PNG)</Trans>
          </Menu.Item>
          <Menu.Item onClick={() => print()}>
            <Trans>Print</Trans>
          </Menu.Item>
          <Menu.Item
            onClick={() => {
              const svg = onVector();
              if (svg) saveVector(svg, name);
            }}
          >
            <Trans>Drawing of the map (SVG)</Trans>
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      {format && <ExportDialog name={name} format={format} onClose={() => setFormat(null)} />}
    </>
  );
}
