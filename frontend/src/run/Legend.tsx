import { CATEGORIES, type Category } from "../api/types";
import { CATEGORY_COLOR, EGO, MARK_COLOR } from "../map/colors";
import type { MarkKind } from "../map/scene";
import { CategoryGlyph } from "../ui/icons";
import { CATEGORY_WORD } from "../ui/words";
import { MARK_WORD } from "./incidents";

/** What the picture's colours and signs mean; only what can be in it. */
export function Legend({
  categories,
  ego,
  lights,
  lamps,
  marks,
}: {
  categories: ReadonlySet<Category>;
  ego: boolean;
  /** Whether traffic lights are shown. */
  lights: boolean;
  /** Whether brake lights and indicators are shown: a recording has none. */
  lamps: boolean;
  marks: ReadonlySet<MarkKind>;
}) {
  if (categories.size === 0) return null;
  return (
    <ul className="map-legend" aria-label="What is shown" style={{ listStyle: "none", margin: 0 }}>
      {CATEGORIES.filter((one) => categories.has(one)).map((kind) => (
        <li key={kind}>
          <span>
            <i style={{ background: CATEGORY_COLOR[kind] }} />
            <CategoryGlyph category={kind} size={16} />
            {CATEGORY_WORD[kind]}
          </span>
        </li>
      ))}
      {ego && (
        <li>
          <span>
            <i style={{ border: `2px solid ${EGO}`, borderRadius: "50%", boxSizing: "border-box" }} />
            Your vehicle
          </span>
        </li>
      )}
      {lights && (
        <li>
          <span>
            <Dot color="#22c55e" />
            <Dot color="#ffc400" />
            <Dot color="#ff3b30" />
            Traffic light
          </span>
        </li>
      )}
      {lamps && (
        <li>
          <span>
            <i style={{ background: "#ff2a1f" }} />
            Brakes
          </span>
        </li>
      )}
      {lamps && (
        <li>
          <span>
            <i style={{ background: "#ffab00" }} />
            Indicator
          </span>
        </li>
      )}
      {[...marks].map((kind) => (
        <li key={kind}>
          <span>
            <i className="mark" style={{ background: MARK_COLOR[kind] }} />
            {MARK_WORD[kind]}
          </span>
        </li>
      ))}
    </ul>
  );
}

function Dot({ color }: { color: string }) {
  return (
    <i
      style={{
        background: color,
        borderRadius: "50%",
        width: 9,
        height: 9,
        border: "1px solid #22262b",
        marginRight: -4,
      }}
    />
  );
}
