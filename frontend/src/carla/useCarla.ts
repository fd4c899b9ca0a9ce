import { useEffect, useState } from "react";

import { carla, type CarlaInfo } from "../api/carla";

const PAUSE = 5000;

/** Whether CARLA is connected, asked again and again; null until it is known. */
export function useCarla(): CarlaInfo | null {
  const [info, setInfo] = useState<CarlaInfo | null>(null);
  useEffect(() => {
    let timer = 0;
    let current = true;
    const look = (): void => {
      carla
        .info()
        .then(
          (found) => {
            if (current) setInfo(found);
          },
          () => {
            if (current) setInfo(null);
          },
        )
        .finally(() => {
          if (current) timer = window.setTimeout(look, PAUSE);
        });
    };
    look();
    return () => {
      current = false;
      window.clearTimeout(timer);
    };
  }, []);
  return info;
}
