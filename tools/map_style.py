"""The look of drawn maps in the documentation, light and dark as the reader prefers."""

STYLE = """\
svg{background:#f2efe8}.scale path{fill:none;stroke:#333}
.scale text{fill:#333;font-family:sans-serif}
.measures text,.names text{stroke:#fff;stroke-width:.18em;paint-order:stroke;
font-weight:700;font-family:sans-serif}
@media (prefers-color-scheme:dark){
svg{background:#1b1f24}
.m-area{fill:#444b53;stroke:#444b53}.m-sidewalk{fill:#34322d;stroke:#34322d}
.m-shoulder,.m-curb,.m-other{fill:#2f343a;stroke:#2f343a}
.m-green{fill:#2b3a2a;stroke:#2b3a2a}.m-bicycle{fill:#573f37;stroke:#573f37}
.m-parking{fill:#343d4b;stroke:#343d4b}.m-casing{stroke:#1b1f24}
.m-building{fill:#272c32;stroke:#343a41}.m-mark{stroke:#8b939c}.m-mark-yellow{stroke:#a98b2c}
.m-crosswalk-ground{fill:#3a4047}.m-bar{fill:#aeb5bc}
.scale path{stroke:#a5afb8}.scale text{fill:#a5afb8}}
""".replace("\n", "")
"""For the classes of :func:`odscen.drawing.svg_layers.map_layers`, as in a report."""
