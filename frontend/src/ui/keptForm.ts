import { type Dispatch, type SetStateAction, useEffect, useState } from "react";

import { pathOf } from "./kept";

const keyOf = (part: string): string => `odscen.form ${pathOf(location.hash)} ${part}`;

/**
 * The state of a form that is sent only when it is whole: it outlives a reload, the back button and a
 * server that is gone, in this window and for this address. What is null is forgotten.
 */
export function useKeptForm<T>(part: string, begun: T): [T, Dispatch<SetStateAction<T>>] {
  // The address may be another one by the time that the form goes.
  const [key] = useState(() => keyOf(part));
  const [form, setForm] = useState<T>(() => kept<T>(key) ?? begun);
  useEffect(() => {
    if (form === null) sessionStorage.removeItem(key);
    else sessionStorage.setItem(key, JSON.stringify(form));
  }, [key, form]);
  return [form, setForm];
}

/** Forgets a form that is sent or given up. */
export const forgetForm = (part: string): void => sessionStorage.removeItem(keyOf(part));

function kept<T>(key: string): T | null {
  const text = sessionStorage.getItem(key);
  return text === null ? null : (JSON.parse(text) as T);
}
