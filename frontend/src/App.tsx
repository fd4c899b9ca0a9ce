import {
  ActionIcon,
  Anchor,
  Loader,
  Tooltip,
  useComputedColorScheme,
  useMantineColorScheme,
} from "@mantine/core";
import { t } from "@lingui/core/macro";
import { useLingui } from "@lingui/react";
import { Trans } from "@lingui/react/macro";
import { lazy, Suspense, useEffect, useRef } from "react";

import { noteViewShown } from "./language/load";
import { PreferencesButton } from "./language/PreferencesButton";
import { chosenHere, usePreferences } from "./language/preferences";
import { IconMoon, IconSun } from "./ui/icons";
import { NoticeList } from "./ui/notices";
import { hashOf, useAddress } from "./ui/address";
import { useTitle } from "./ui/titles";

// What a view needs is loaded when it is first shown.
const CatalogueView = lazy(async () => ({
  default: (await import("./catalogue/CatalogueView")).CatalogueView,
}));
const EditorView = lazy(async () => ({ default: (await import("./editor/EditorView")).EditorView }));
const ImportView = lazy(async () => ({ default: (await import("./exchange/ImportView")).ImportView }));
const MendView = lazy(async () => ({ default: (await import("./mending/MendView")).MendView }));
const RunView = lazy(async () => ({ default: (await import("./run/RunView")).RunView }));
const RecordingView = lazy(async () => ({
  default: (await import("./recordings/RecordingView")).RecordingView,
}));
const SweepsView = lazy(async () => ({ default: (await import("./experiments/SweepsView")).SweepsView }));
const SweepView = lazy(async () => ({ default: (await import("./experiments/SweepView")).SweepView }));
const StudiesView = lazy(async () => ({ default: (await import("./experiments/StudiesView")).StudiesView }));
const StudyView = lazy(async () => ({ default: (await import("./experiments/StudyView")).StudyView }));
const RunsView = lazy(async () => ({ default: (await import("./run/RunsView")).RunsView }));

/** Beside a view, it is there when the view is. */
function ViewShown() {
  useEffect(noteViewShown, []);
  return null;
}

/** A key that changes with the preferences when they were chosen in this tab. */
function useAnew(preferred: string): number {
  const last = useRef({ preferred, key: 0 });
  if (last.current.preferred !== preferred)
    last.current = { preferred, key: last.current.key + (chosenHere() ? 1 : 0) };
  return last.current.key;
}

/** One window: catalogue, editor and run. */
export function App() {
  const address = useAddress();
  const title = useTitle("scenario" in address ? address.scenario : "");
  const { setColorScheme } = useMantineColorScheme();
  const { i18n } = useLingui();
  const { speed, length, hours } = usePreferences();
  const anew = useAnew(`${i18n.locale} ${speed} ${length} ${hours}`);
  const dark = useComputedColorScheme("light") === "dark";
  const toggle = dark ? t`Use light colours` : t`Use dark colours`;
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
        <Trans>Skip to the content</Trans>
      </a>
      <header className="head">
        <Anchor className="brand" href={hashOf({ view: "catalogue" })} underline="never">
          <img src="./icon.svg" alt="" width={26} height={26} />
          <span>odscen</span>
        </Anchor>
        <nav aria-label={t`Where you are`} className="crumbs">
          <Anchor href="#/" aria-current={address.view === "catalogue" ? "page" : undefined}>
            <Trans>Maps and scenarios</Trans>
          </Anchor>
          {"scenario" in address && (
            <>
              <span aria-hidden="true">›</span>
              <Anchor
                href={hashOf({ view: "editor", scenario: address.scenario })}
                aria-current={address.view === "editor" ? "page" : undefined}
              >
                {title}
              </Anchor>
            </>
          )}
          {address.view === "imported" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">
                <Trans>Import</Trans>
              </span>
            </>
          )}
          {address.view === "mend" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">{address.map}</span>
            </>
          )}
          {address.view === "recording" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">{address.recording}</span>
            </>
          )}
          {address.view === "run" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">
                <Trans>Run</Trans>
              </span>
            </>
          )}
          {address.view === "runs" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">
                <Trans>Runs</Trans>
              </span>
            </>
          )}
          {(address.view === "sweeps" || address.view === "sweep") && (
            <>
              <span aria-hidden="true">›</span>
              <Anchor
                href={hashOf({ view: "sweeps", scenario: address.scenario })}
                aria-current={address.view === "sweeps" ? "page" : undefined}
              >
                <Trans>Sweeps</Trans>
              </Anchor>
            </>
          )}
          {(address.view === "studies" || address.view === "study") && (
            <>
              <span aria-hidden="true">›</span>
              <Anchor
                href={hashOf({ view: "studies" })}
                aria-current={address.view === "studies" ? "page" : undefined}
              >
                <Trans>Studies</Trans>
              </Anchor>
            </>
          )}
          {address.view === "study" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">{address.study}</span>
            </>
          )}
          {address.view === "sweep" && (
            <>
              <span aria-hidden="true">›</span>
              <span aria-current="page">{address.sweep}</span>
            </>
          )}
        </nav>
        <div id="head-slot" className="head-slot" />
        <PreferencesButton />
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
        {/* A view begins anew in another language or unit; what it had is saved. */}
        <Suspense key={anew} fallback={<Loader m="xl" aria-label={t`Loading the page`} />}>
          <ViewShown />
          {address.view === "catalogue" && <CatalogueView />}
          {address.view === "editor" && <EditorView key={address.scenario} scenario={address.scenario} />}
          {address.view === "imported" && <ImportView key={address.scenario} scenario={address.scenario} />}
          {address.view === "recording" && (
            <RecordingView key={address.recording} recording={address.recording} />
          )}
          {address.view === "mend" && <MendView key={address.map} map={address.map} />}
          {address.view === "run" && (
            <RunView key={address.run} scenario={address.scenario} run={address.run} />
          )}
          {address.view === "sweeps" && <SweepsView key={address.scenario} scenario={address.scenario} />}
          {address.view === "sweep" && (
            <SweepView key={address.sweep} scenario={address.scenario} sweep={address.sweep} />
          )}
          {address.view === "studies" && <StudiesView />}
          {address.view === "study" && <StudyView key={address.study} study={address.study} />}
          {address.view === "runs" && <RunsView key={address.scenario} scenario={address.scenario} />}
        </Suspense>
      </main>
      <NoticeList />
    </div>
  );
}
