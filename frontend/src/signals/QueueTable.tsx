import type { Queue } from "./queues";

/** Who waits now, by approach. */
export function QueueTable({ queues }: { queues: readonly Queue[] }) {
  return (
    <table className="signal-table" aria-label="Queues now">
      <thead>
        <tr>
          <th scope="col">Approach</th>
          <th scope="col">Queued</th>
          <th scope="col">Back of queue</th>
        </tr>
      </thead>
      <tbody>
        {queues.map(({ approach, vehicles, metres }) => (
          <tr key={approach}>
            <th scope="row">{approach}</th>
            <td>{vehicles}</td>
            <td>{vehicles > 0 ? `${Math.round(metres)} m` : "–"}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
