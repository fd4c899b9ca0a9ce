import { i18n } from "@lingui/core";
import { Alert, Anchor, Button, Loader, Select, Table, Text, Title } from "@mantine/core";
import { plural, t } from "@lingui/core/macro";
import { Plural, Trans } from "@lingui/react/macro";
import { served } from "../language/served";
import { type FigureGroup, type StudyInfo, type StudyResults, studies } from "../api/studies";
import { lasting } from "./plan";
import { go, hashOf } from "../ui/address";
import { tellError } from "../ui/notices";
import { ExperimentHead } from "./ExperimentHead";
import { FigurePlot } from "./FigurePlot";
import { differenceWords, inReadersUnits, matters, meanWord, outcomeWord, variantWord } from "./groups";
import { useStudy } from "./useStudy";
import "./experiments.css";

/** One study: how far it is, why runs failed, and its figures. */
export function StudyView({ study }: { study: string }) {
  const { info, results, error, choose, reload } = useStudy(study);
  return (
    <div className="sweeps-view">
      <Title order={1} size="h2" mb="xs">
        <Trans>Study {study}</Trans>
      </Title>
      {error && (
        <Alert color="red" title={t`The study cannot be shown`}>
          {error}
        </Alert>
      )}
      {!info && !error && <Loader aria-label={t`Loading the study`} />}
      {info && <Head info={info} onChanged={reload} />}
      {info && info.problems.length > 0 && <Problems info={info} onChanged={reload} />}
      {results && <Figures results={inReadersUnits(results)} onChoose={choose} />}
    </div>
  );
}

/** Outcome or progress, and what can be done. */
function Head({ info, onChanged }: { info: StudyInfo; onChanged: () => void }) {
  const { study, state, runs, ended, seconds_left: left, error } = info;
  return (
    <ExperimentHead
      name={study}
      state={state}
      share={(100 * ended) / runs}
      error={error}
      elsewhere={info.elsewhere}
      words={{
        progress: t`Runs that have ended`,
        failed: t`The study has failed`,
        remove: t`Delete the study`,
        all: t`All studies`,
      }}
      actions={{
        stop: () => studies.stop(study),
        resume: () => studies.resume(study, 2),
        remove: () => studies.remove(study),
      }}
      links={
        <>
          {ended > 0 && (
            <Anchor href={studies.fileUrl(study, "study.html")} target="_blank" rel="noreferrer">
              <Trans>Download as HTML</Trans>
            </Anchor>
          )}
          {state === "done" && (
            <Anchor href={studies.fileUrl(study, "results.parquet")}>
              <Trans>Table as Parquet</Trans>
            </Anchor>
          )}
        </>
      }
      all={hashOf({ view: "studies" })}
      lost={
        <Trans>
          The figures of its <Plural value={ended} one="# run" other="# runs" /> are deleted for good. The
          scenarios stay.
        </Trans>
      }
      onChanged={onChanged}
      onRemoved={() => go({ view: "studies" })}
    >
      {plural(info.scenarios.length, { one: "# scenario", other: "# scenarios" })} ×{" "}
      {plural(info.variants.length, { one: "# variant", other: "# variants" })} ×{" "}
      {plural(info.seeds, { one: "# seed", other: "# seeds" })}: {outcomeWord(info)}
      {state === "running" && left !== null && t`, about ${lasting(left)} left`}
      {state === "stopped" && t`. It was stopped; what is missing can be run at any time`}
      {info.elsewhere && t`. Another process works on it`}.
    </ExperimentHead>
  );
}

/** Why runs failed, the most frequent reason first. */
function Problems({ info, onChanged }: { info: StudyInfo; onChanged: () => void }) {
  const again = (): void => {
    studies.resume(info.study, 2, true).then(onChanged, tellError);
  };
  return (
    <Alert
      color="red"
      title={t`${plural(info.ended - info.completed, { one: "# run", other: "# runs" })} failed`}
      my="sm"
    >
      <ul className="study-problems" aria-label={t`Why runs failed`}>
        {info.problems.map(({ words, runs }) => (
          <li key={words}>
            {plural(runs, { one: "# run", other: "# runs" })}: {served(words)}
          </li>
        ))}
      </ul>
      {info.state === "done" && (
        <Button mt="xs" size="compact-sm" variant="white" onClick={again}>
          <Trans>Run those again</Trans>
        </Button>
      )}
    </Alert>
  );
}

/** The figure that is chosen: as a picture, as means, and as differences between variants. */
function Figures({ results, onChoose }: { results: StudyResults; onChoose: (figure: string) => void }) {
  const figure = results.figures.find(({ name }) => name === results.figure);
  const first = results.groups[0]?.scenario ?? "";
  return (
    <>
      <Select
        label={t`Figure`}
        maw={360}
        mt="md"
        searchable
        allowDeselect={false}
        data={results.figures.map(({ name, label, unit }) => ({
          value: name,
          label: unit ? `${served(label)}, ${unit}` : served(label),
        }))}
        value={results.figure}
        onChange={(next) => {
          if (next !== null) onChoose(next);
        }}
      />
      {figure && results.between.length > 0 && (
        <ul className="study-sentences" aria-label={t`In a sentence`}>
          {results.between.map((one) => (
            <li key={`${one.scenario}/${one.variant}`}>
              {differenceWords(figure, one, first)}
              {results.differences.length > 0 && ` ${variantWord(one.variant)}`}
            </li>
          ))}
        </ul>
      )}
      <FigurePlot results={results} />
      <Title order={2} size="h4" mt="lg" mb="xs">
        <Trans>Means</Trans>
      </Title>
      <GroupTable groups={results.groups} label={t`Means`} />
      {results.between.length > 0 && (
        <>
          <Title order={2} size="h4" mt="lg" mb="xs">
            <Trans>Differences from {first}</Trans>
          </Title>
          <Text size="sm" mb="xs">
            <Trans>Between runs of the same seed, so that what they share does not count.</Trans>
          </Text>
          <GroupTable groups={results.between} label={t`Differences between scenarios`} judged />
        </>
      )}
      {results.differences.length > 0 && (
        <>
          <Title order={2} size="h4" mt="lg" mb="xs">
            <Trans>Differences from the first variant</Trans>
          </Title>
          <Text size="sm" mb="xs">
            <Trans>
              Between runs of the same scenario and seed, so that what they share does not count. Where the
              interval does not reach 0, the variant makes a difference.
            </Trans>
          </Text>
          <GroupTable groups={results.differences} label={t`Differences`} judged />
        </>
      )}
    </>
  );
}

function GroupTable({ groups, label, judged }: { groups: FigureGroup[]; label: string; judged?: boolean }) {
  return (
    // Nothing in it takes the focus, so that the keyboard scrolls it only when the container does.
    <Table.ScrollContainer minWidth={520} scrollAreaProps={{ viewportProps: { tabIndex: 0 } }}>
      <Table verticalSpacing={4} fz={14} aria-label={label}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>
              <Trans>Scenario</Trans>
            </Table.Th>
            <Table.Th>
              <Trans>Variant</Trans>
            </Table.Th>
            <Table.Th>
              <Trans>Runs</Trans>
            </Table.Th>
            <Table.Th>
              <Trans>Mean, 95 % interval</Trans>
            </Table.Th>
            {judged && (
              <Table.Th>
                <Trans>Clear difference</Trans>
              </Table.Th>
            )}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {groups.map((one) => (
            <Table.Tr key={`${one.scenario}/${one.variant}`}>
              <Table.Td>{one.scenario}</Table.Td>
              <Table.Td>{variantWord(one.variant)}</Table.Td>
              <Table.Td>{one.runs.toLocaleString(i18n.locale)}</Table.Td>
              <Table.Td>{meanWord(one)}</Table.Td>
              {judged && <Table.Td>{matters(one) ? t`yes` : t`no`}</Table.Td>}
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}
