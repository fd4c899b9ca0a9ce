import { Alert, Button, Loader, Text, Title } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Trans } from "@lingui/react/macro";
import { useEffect, useState } from "react";

import { api } from "../api/client";
import type { MapDetails } from "../api/types";
import type { PackedDrawing } from "../map/drawing";
import { type LoadedGraph, loadDrawing, loadGraph } from "../map/loaded";
import { go } from "../ui/address";
import { reasonOf } from "../ui/reason";
import { useLearnedTitle, useTitle } from "../ui/titles";
import { useLoaded } from "../ui/useLoaded";
import { Editor } from "./Editor";
import { editorStoreOf } from "./store";

/** Loads what the editor needs and says what is missing. */
export function EditorView({ scenario: name }: { scenario: string }) {
  const [store] = useState(() => editorStoreOf(name));
  const map = store((state) => state.scenario?.document.map.name);
  useLearnedTitle(
    name,
    store((state) => state.scenario?.document.name),
  );
  const [details, setDetails] = useState<MapDetails | null>(null);
  const [failure, setFailure] = useState<string | null>(null);
  const [drawing, setDrawing] = useState<PackedDrawing | null>(null);
  const [loaded, setLoaded] = useState<LoadedGraph | null>(null);
  const assets = useLoaded(api.assets);
  const title = useTitle(name);

  useEffect(() => {
    store
      .getState()
      .load()
      .catch((error: unknown) => setFailure(reasonOf(error)));
  }, [store]);
  useEffect(() => {
    if (!map) return;
    const fail = (error: unknown): void => setFailure(reasonOf(error));
    loadDrawing(map).then(setDrawing, fail);
    loadGraph(map).then(setLoaded, fail);
    api.map(map).then(setDetails, fail);
  }, [map]);

  if (failure) {
    return (
      <div className="catalogue">
        <Title order={1} size="h3" mb="md">
          <Trans>“{title}” cannot be opened</Trans>
        </Title>
        <Alert color="red">{failure}</Alert>
        <Button mt="md" onClick={() => go({ view: "catalogue" })}>
          <Trans>Back to the maps</Trans>
        </Button>
      </div>
    );
  }
  if (!drawing || !loaded || !map) {
    return (
      <div className="empty">
        <Loader aria-label={t`Opening the scenario`} />
        <Text mt="sm">
          <Trans>Opening {title} …</Trans>
        </Text>
      </div>
    );
  }
  return <Editor store={store} drawing={drawing} loaded={loaded} assets={assets.value} map={details} />;
}
