// Numbers and units.

import type { Column } from "./data";

export type Units = "author" | "si";

/** Number with so many significant digits, without trailing zeros. */
export function significant(value: number, digits = 4): string {
    if (!Number.isFinite(value)) return "\u2013";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
    return String(Number(value.toPrecision(digits)));
}

/** Whole number with thin spaces between groups of three. */
export function grouped(value: number): string {
    const digits = String(Math.round(value));
    return digits.length > 4 ? digits.replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f") : digits;
}

export function unitText(unit: string): string {
    return unit === "1" ? "" : unit.replaceAll("^2", "\u00b2");
}

/** Unit and factor in which a column is shown. */
export function shownAs(column: Column, units: Units): { unit: string; factor: number } {
    return units === "author" && column.shown ? column.shown : { unit: unitText(column.unit), factor: 1 };
}

/** Label of a column with its loop. */
export function columnText(column: Column): string {
    return column.side ? `${column.label}, ${column.side}` : column.label;
}

/** Label of an axis. */
export function axisText(column: Column, units: Units): string {
    const { unit } = shownAs(column, units);
    return unit ? `${columnText(column)} [${unit}]` : columnText(column);
}

/** Value of a column with its unit. */
export function valueText(column: Column, value: number, units: Units): string {
    if (!Number.isFinite(value)) return "\u2013";
    const { unit, factor } = shownAs(column, units);
    return unit ? `${significant(factor * value)} ${unit}` : significant(factor * value);
}

/** SI value with its unit. */
export function siText(value: number, unit: string): string {
    if (!Number.isFinite(value)) return "\u2013";
    const text = unitText(unit);
    return text ? `${significant(value)} ${text}` : significant(value);
}

export function percent(share: number): string {
    return `${significant(100 * share, 3)} %`;
}

/** Word of a result file as text. */
export function wordText(word: string): string {
    return word.replaceAll("_", " ");
}
