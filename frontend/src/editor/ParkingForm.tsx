import { t } from "@lingui/core/macro";

import type { TripParking } from "../api/demand";
import type { Edit, FieldsOf } from "../api/types";
import { Committed } from "./Committed";

const USUAL_STAY = 3600;
const USUAL_WITHIN = 300;

/** Shares of the cars of the demand that begin and end in parking places of the map. */
export function ParkingForm({ parking, onEdit }: { parking: TripParking; onEdit: (edit: Edit) => void }) {
  const change = (fields: FieldsOf<"set_parking", never>): void => onEdit({ kind: "set_parking", ...fields });
  return (
    <section className="fold" aria-label={t`Parking of trips`}>
      <Committed
        label={t`Cars that begin in a parking place`}
        suffix=" %"
        min={0}
        max={100}
        digits={0}
        value={100 * parking.begin}
        onCommit={(share) => change({ begin: (share ?? 0) / 100 })}
      />
      <Committed
        label={t`Cars that end in a parking place`}
        suffix=" %"
        min={0}
        max={100}
        digits={0}
        value={100 * parking.end}
        onCommit={(share) => change({ end: (share ?? 0) / 100 })}
      />
      {(parking.begin > 0 || parking.end > 0) && (
        <>
          <Stay stay={parking.stay} onChange={(value) => change({ stay: { kind: "constant", value } })} />
          <Committed
            label={t`At most away from start or destination, between zones`}
            suffix={" m"}
            min={10}
            max={10_000}
            digits={0}
            value={parking.within}
            onCommit={(within) => change({ within: within ?? USUAL_WITHIN })}
          />
        </>
      )}
    </section>
  );
}

/** How long a place is taken; a distribution of a document is said, and becomes a number when one is given. */
function Stay({ stay, onChange }: { stay: TripParking["stay"]; onChange: (seconds: number) => void }) {
  const drawn = typeof stay !== "number";
  return (
    <Committed
      label={t`A place is taken for`}
      suffix={" min"}
      min={0}
      max={1440}
      digits={1}
      placeholder={drawn ? t`drawn for each trip` : "60 min"}
      value={drawn ? "" : stay / 60}
      onCommit={(minutes) => onChange(minutes === null ? USUAL_STAY : minutes * 60)}
    />
  );
}
