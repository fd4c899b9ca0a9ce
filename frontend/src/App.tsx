import { ActionIcon, Anchor, Tooltip, useComputedColorScheme, useMantineColorScheme } from "@mantine/core";

import { CatalogueView } from "./catalogue/CatalogueView";
import { EditorView } from "./editor/EditorView";
import { RunsView } from "./run/RunsView";
import { RunView } from "./run/RunView";
import { IconMoon, IconSun } from "./ui/icons";
import { NoticeList } from "./ui/notices";
import { hashOf, useAddress } from "./ui/address";

/** One window: catalogue, editor and run. */
export function App() {
  const address = useAddress();
  const { setColorScheme } = useMantineColorScheme();
  const dark = useComputedColorScheme("light") === "dark";
  const toggle = dark ? "Use light colours" : "Use dark colours";
  return (
    <div className="page">
      <a
        className="skip"
        href="#main"
        onClick={(event) => {
          event.preventDefault();
          document.getElementById("main")?.focus();
        }}
      >
        Skip to the content
      </a>
      <header className="head">
        <Anchor className="brand" href={hashOf({ view: "catalogue" })} underline="never">
          <img src="./icon.svg" alt="" width={26} height={26} />
          <span>odscen</span>
        </Anchor>
        <nav aria-label="Where you are" className="crumbs">
          <Anchor href="#/" aria-current={address.view === "catalogue" ? "page" : undefined}>
            Maps and scenarios
          </Anchor>
          {address.view !== "catalogue" && (
            <>
              <span aria-hidden="true">›</span>
              <Anchor
                href={hashOf({ view: "editor", scenario: address.scenario })}
                aria-current={address.view === "editor" ? "page" : undefined}
              >
                {address.scenario}
              </Anchor>
            </>
          )}
          {address.view === "run" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">Run</span>
            </>
          )}
          {address.view === "runs" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">Runs</span>
            </>
          )}
        </nav>
        <div id="head-slot" className="head-slot" />
        <Tooltip label={toggle}>
          <ActionIcon
            variant="subtle"
            color="gray"
            size="lg"
            aria-label={toggle}
            onClick={() => setColorScheme(dark ? "light" : "dark")}
          >
            {dark ? <IconSun /> : <IconMoon />}
          </ActionIcon>
        </Tooltip>
      </header>
      <main id="main" tabIndex={-1} className="main">
        {address.view === "catalogue" && <CatalogueView />}
        {address.view === "editor" && <EditorView key={address.scenario} scenario={address.scenario} />}
        {address.view === "run" && (
          <RunView key={address.run} scenario={address.scenario} run={address.run} />
        )}
        {address.view === "runs" && <RunsView key={address.scenario} scenario={address.scenario} />}
      </main>
      <NoticeList />
    </div>
  );
}
