import { roundLength } from "../language/units";

/** Pixels of the bar, at most. */
const LONG = 110;

/** A bar as long as a round length is on the map. */
export function ScaleBar({ scale }: { scale: number }) {
  const { metres, text } = roundLength(LONG / scale);
  return (
    <div className="map-scale" aria-hidden="true" style={{ width: metres * scale }}>
      {text}
    </div>
  );
}
