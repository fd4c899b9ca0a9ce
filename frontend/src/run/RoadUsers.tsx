import { Button, Group, Text, TextInput } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { useEffect, useState } from "react";

import { speedText } from "../language/units";
import type { Category } from "../api/types";
import { nth } from "../lists";
import { CategoryGlyph, IconSearch } from "../ui/icons";
import { CATEGORY_WORD } from "../ui/words";
import type { Picture } from "./usePicture";

const PAUSE = 1000;
/** Rows of the list; one of thousands is found by a part of its name. */
const LISTED = 60;
const natural = new Intl.Collator("en", { numeric: true });

interface Row {
  id: string;
  category: Category;
  ego: boolean;
  speed: number;
}

/** All road users on the road now; one of them can be followed. */
export function RoadUsers({
  latest,
  followed,
  onFollow: follow,
  view,
  wanted,
}: {
  latest: Picture["latest"];
  followed: string | null;
  onFollow: (id: string | null) => void;
  /** Which view of several follows; null of one alone. */
  view: string | null;
  wanted: boolean;
}) {
  const [rows, setRows] = useState<Row[]>([]);
  const [search, setSearch] = useState("");
  useEffect(() => {
    if (!wanted) return;
    const read = (): void => setRows(onTheRoad(latest()));
    read();
    const timer = setInterval(read, PAUSE);
    return () => clearInterval(timer);
  }, [latest, wanted]);
  const word = search.trim().toLowerCase();
  const found = rows.filter(
    ({ id, category }) => !word || `${id} ${CATEGORY_WORD()[category]}`.toLowerCase().includes(word),
  );
  const ego = rows.find((row) => row.ego);
  return (
    <>
      <Group gap="xs">
        <Button
          size="xs"
          disabled={!ego}
          onClick={() => {
            if (ego) follow(ego.id);
          }}
        >
          <Trans>Follow my vehicle</Trans>
        </Button>
        <Button size="xs" variant="default" disabled={followed === null} onClick={() => follow(null)}>
          <Trans>Stop following</Trans>
        </Button>
      </Group>
      {view !== null && (
        <Text size="sm" mt="sm" aria-live="polite">
          <Trans>{view} was used last: it follows whom you choose.</Trans>
        </Text>
      )}
      <TextInput
        mt="sm"
        label={t`Find a road user`}
        placeholder={t`Part of the name, or a kind`}
        leftSection={<IconSearch />}
        value={search}
        onChange={(event) => setSearch(event.currentTarget.value)}
      />
      {rows.length === 0 && (
        <Text size="sm" c="dimmed" mt="sm">
          <Trans>No road user is on the road now.</Trans>
        </Text>
      )}
      {rows.length > 0 && found.length === 0 && (
        <Text size="sm" mt="sm">
          <Trans>No road user on the road matches “{search}”.</Trans>
        </Text>
      )}
      <ul className="rows" aria-label={t`Follow a road user`}>
        {found.slice(0, LISTED).map((row) => (
          <li key={row.id}>
            <button
              type="button"
              aria-pressed={row.id === followed}
              onClick={() => follow(row.id === followed ? null : row.id)}
            >
              <CategoryGlyph category={row.category} size={20} />
              {row.id}
              {row.ego && t` (yours)`}
              <span className="far">{speedText(row.speed)}</span>
            </button>
          </li>
        ))}
      </ul>
      {found.length > LISTED && (
        <Text size="sm" c="dimmed" mt="xs">
          <Trans>
            <Plural value={found.length - LISTED} one="# more road user" other="# more road users" />: type a
            part of the name.
          </Trans>
        </Text>
      )}
    </>
  );
}

function onTheRoad(latest: ReturnType<Picture["latest"]>): Row[] {
  if (!latest) return [];
  const { frame, crowd } = latest;
  const rows: Row[] = [];
  for (let i = 0; i < frame.count; i++) {
    const who = crowd.named(nth(frame.rows, 6 * i));
    if (who)
      rows.push({
        id: who.id,
        category: who.category,
        ego: who.ego ?? false,
        speed: nth(frame.rows, 6 * i + 4),
      });
  }
  return rows.sort((a, b) => Number(b.ego) - Number(a.ego) || natural.compare(a.id, b.id));
}
