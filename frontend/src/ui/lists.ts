/** Whether Escape is meant for the list or menu that is open where it was pressed, not for what is below. */
export const closesList = ({ target }: { target: EventTarget }): boolean =>
  target instanceof Element &&
  (target.closest("[role=listbox], [role=menu]") !== null ||
    target.matches("[data-expanded], [aria-haspopup][aria-expanded=true]"));
