import type { ReactNode } from "react";

import type { Category } from "../api/types";
import { CATEGORY_COLOR } from "../map/colors";
import { GLYPHS } from "../map/glyphs";

function icon(path: ReactNode) {
  return function Icon({ size = 18 }: { size?: number }) {
    return (
      <svg
        width={size}
        height={size}
        viewBox="0 0 24 24"
        fill="none"
        stroke="currentColor"
        strokeWidth={2}
        strokeLinecap="round"
        strokeLinejoin="round"
        aria-hidden="true"
      >
        {path}
      </svg>
    );
  };
}

export const IconLanguage = icon(
  <>
    <circle cx="12" cy="12" r="9" />
    <path d="M3 12h18M12 3c3 3 3 15 0 18M12 3c-3 3-3 15 0 18" />
  </>,
);
export const IconPlus = icon(<path d="M12 5v14M5 12h14" />);
export const IconMinus = icon(<path d="M5 12h14" />);
export const IconRuler = icon(<path d="M3 16 16 3l5 5L8 21zM7 12l2 2M10 9l3 3M13 6l2 2" />);
export const IconLayers = icon(<path d="m12 3 9 5-9 5-9-5zM3 12.5l9 5 9-5M3 17l9 5 9-5" />);
export const IconFit = icon(<path d="M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5" />);
export const IconViews = icon(<path d="M4 5h16v14H4zM12 5v14" />);
export const IconUndo = icon(<path d="M9 14 4 9l5-5M4 9h10a6 6 0 0 1 0 12h-3" />);
export const IconRedo = icon(<path d="m15 14 5-5-5-5M20 9H10a6 6 0 0 0 0 12h3" />);
export const IconSun = icon(
  <>
    <circle cx="12" cy="12" r="4" />
    <path d="M12 2v2m0 16v2M4.900 4.900l1.400 1.400m11.400 11.400 1.400 1.400" />
    <path d="M2 12h2m16 0h2M4.900 19.100l1.400-1.400M17.700 6.300l1.400-1.400" />
  </>,
);
export const IconMoon = icon(
  <path d="M20 14.500A8.500 8.500 0 1 1 9.500 4a6.800 6.800 0 0 0 10.500 10.500z" />,
);
export const IconTrash = icon(<path d="M4 7h16M10 11v6m4-6v6M6 7l1 13h10l1-13M9 7V4h6v3" />);
export const IconSearch = icon(
  <>
    <circle cx="11" cy="11" r="6" />
    <path d="m20 20-4.500-4.500" />
  </>,
);
export const IconPlay = icon(<path d="M7 4.500v15l12-7.500z" fill="currentColor" />);
export const IconPause = icon(<path d="M8 5v14M16 5v14" strokeWidth={3.5} />);
export const IconStep = icon(
  <>
    <path d="M6 5v14l9-7z" fill="currentColor" />
    <path d="M18.500 5v14" />
  </>,
);
export const IconStop = icon(<rect x="6" y="6" width="12" height="12" rx="1.500" fill="currentColor" />);
export const IconBack = icon(<path d="m14 6-6 6 6 6" />);
export const IconWarn = icon(<path d="M12 4 2.500 20h19zM12 10v4m0 3v.01" />);
export const IconCheck = icon(<path d="m5 12.500 4.500 4.500L19 7.500" />);
export const IconTour = icon(<path d="M6 21V4m0 1h12l-3 4 3 4H6" />);
export const IconTarget = icon(
  <>
    <circle cx="12" cy="12" r="6" />
    <path d="M12 2v5m0 10v5M2 12h5m10 0h5" />
  </>,
);
export const IconDown = icon(<path d="M12 4v11m-5-5 5 5 5-5M5 20h14" />);
export const IconFlow = icon(<path d="m3 6 5 6-5 6M10 6l5 6-5 6M17 6l5 6-5 6" strokeWidth={2.5} />);
export const IconDice = icon(
  <>
    <rect x="4" y="4" width="16" height="16" rx="3" />
    <path
      d="M8.500 8.500h.01M15.500 8.500h.01M12 12h.01M8.500 15.500h.01M15.500 15.500h.01"
      strokeWidth={2.8}
    />
  </>,
);
export const IconMenu = icon(<path d="M4 7h16M4 12h16M4 17h16" />);
export const IconHelp = icon(
  <>
    <circle cx="12" cy="12" r="9" />
    <path d="M9.500 9.500a2.500 2.500 0 1 1 3.500 2.300c-.7.3-1 .8-1 1.700m0 3v.01" />
  </>,
);

export function CategoryGlyph({ category, size = 28 }: { category: Category; size?: number }) {
  return (
    <svg width={size} height={size} viewBox="0 0 24 24" aria-hidden="true">
      <path d={GLYPHS[category]} fillRule="evenodd" fill={CATEGORY_COLOR[category]} />
    </svg>
  );
}
