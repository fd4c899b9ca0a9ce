import { useComputedColorScheme } from "@mantine/core";
import { t } from "@lingui/core/macro";
import { useEffect, useRef, useState } from "react";

import { BaseLayer } from "../map/baseLayer";
import { DARK, LIGHT } from "../map/colors";
import { loadDrawing } from "../map/loaded";
import { FIRST_LAYERS } from "../map/mapLayers";
import { fit } from "../map/view";

/** A map drawn into its card, once the card is seen; the stored picture if that fails. */
export function Preview({ name, picture }: { name: string; picture: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const dark = useComputedColorScheme("light") === "dark";
  const [layer, setLayer] = useState<{ base: BaseLayer; bounds: [number, number, number, number] } | null>(
    null,
  );
  const [failed, setFailed] = useState(false);
  const label = t`The map ${name} seen from above`;

  useEffect(() => {
    if (!canvas.current) return;
    const observer = new IntersectionObserver(
      (entries) => {
        if (!entries.some((entry) => entry.isIntersecting)) return;
        observer.disconnect();
        loadDrawing(name).then(
          (drawing) => setLayer({ base: new BaseLayer(drawing), bounds: drawing.bounds }),
          () => setFailed(true),
        );
      },
      { rootMargin: "200px" },
    );
    observer.observe(canvas.current);
    return () => observer.disconnect();
  }, [name]);

  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    if (!canvas.current || !context || !layer) return;
    const ratio = window.devicePixelRatio || 1;
    const size = { width: canvas.current.clientWidth, height: canvas.current.clientHeight };
    canvas.current.width = size.width * ratio;
    canvas.current.height = size.height * ratio;
    layer.base.draw(context, fit(layer.bounds, size, 0.04), size, ratio, dark ? DARK : LIGHT, FIRST_LAYERS);
  }, [layer, dark]);

  if (failed) return <img className="card-picture" src={picture} alt={label} loading="lazy" />;
  return <canvas ref={canvas} className="card-picture" role="img" aria-label={label} />;
}
