/** The text of a scenario in CodeMirror, in a shadow root, because its styles then need no inline element. */

import {
  autocompletion,
  completionKeymap,
  type CompletionContext,
  type CompletionResult,
} from "@codemirror/autocomplete";
import { defaultKeymap, indentWithTab } from "@codemirror/commands";
import { HighlightStyle, StreamLanguage, syntaxHighlighting } from "@codemirror/language";
import { toml } from "@codemirror/legacy-modes/mode/toml";
import { lintGutter, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { Annotation, Compartment, EditorState } from "@codemirror/state";
import { EditorView, highlightActiveLine, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { completionAt } from "../edit/complete";
import type { TomlTable } from "../edit/keypath";
import type { WorldSchema } from "../edit/schema";
import type { Problem } from "../protocol";

const COLORS = EditorView.theme({
  "&": { height: "100%", color: "var(--ink)", backgroundColor: "var(--panel)", fontSize: "13px" },
  ".cm-scroller": { fontFamily: "var(--mono)", lineHeight: "1.5" },
  ".cm-gutters": { color: "var(--faint)", backgroundColor: "var(--bg)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine": { backgroundColor: "color-mix(in srgb, var(--hover) 55%, transparent)" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  "&.cm-focused": { outline: "2px solid var(--accent)", outlineOffset: "-2px" },
  "& .cm-selectionBackground, &.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground": {
    backgroundColor: "var(--chosen)",
  },
  ".cm-tooltip": { color: "var(--ink)", backgroundColor: "var(--panel)", border: "1px solid var(--strong-line)" },
  ".cm-tooltip-autocomplete > ul": { fontFamily: "var(--mono)", maxHeight: "14em" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { color: "var(--ink)", backgroundColor: "var(--chosen)" },
  ".cm-completionInfo": {
    maxWidth: "44ch",
    padding: "4px 8px",
    fontFamily: "system-ui, sans-serif",
    whiteSpace: "pre-line",
  },
  ".cm-diagnostic": { whiteSpace: "pre-line", maxWidth: "60ch" },
});

const HIGHLIGHT = HighlightStyle.define([
  { tag: tags.comment, color: "var(--faint)", fontStyle: "italic" },
  { tag: [tags.string, tags.special(tags.string)], color: "var(--good)" },
  { tag: [tags.number, tags.atom, tags.bool], color: "var(--warn)" },
  { tag: [tags.propertyName, tags.definition(tags.variableName)], color: "var(--accent)" },
  { tag: tags.heading, color: "var(--accent)", fontWeight: "600" },
]);

export interface EditorHooks {
  onChange(text: string): void;
  onUndo(): void;
  onRedo(): void;
  /** The world's schema and the values of the text, once they are known. */
  schema(): { world: WorldSchema; model: TomlTable | null } | null;
}

/** Marks changes from outside this view. */
const EXTERNAL_CHANGE = Annotation.define<boolean>();

/** Completions from the schema, with descriptions. */
function completions(hooks: EditorHooks): (context: CompletionContext) => CompletionResult | null {
  return (context) => {
    const known = hooks.schema();
    const found = known && completionAt(context.state.doc.toString(), context.pos, known.world, known.model);
    if (!found || (found.from === context.pos && !context.explicit)) return null;
    const options = found.options.map(({ label, words, kind }) => ({
      label,
      info: words || undefined,
      type: kind === "key" ? "property" : kind === "section" ? "namespace" : "constant",
      apply: kind === "key" ? `${label} = ` : label,
    }));
    return { from: found.from, options, validFor: /^"?[\w.-]*$/ };
  };
}

export class Editor {
  readonly #view: EditorView;
  readonly #locked = new Compartment();

  constructor(host: HTMLElement, hooks: EditorHooks) {
    const root = host.shadowRoot ?? host.attachShadow({ mode: "open" });
    const frame = document.createElement("div");
    frame.className = "frame";
    frame.style.height = "100%";
    root.replaceChildren(frame);
    const steps = keymap.of([
      { key: "Mod-z", run: () => (hooks.onUndo(), true), preventDefault: true },
      { key: "Mod-Shift-z", run: () => (hooks.onRedo(), true), preventDefault: true },
      { key: "Mod-y", run: () => (hooks.onRedo(), true), preventDefault: true },
      // Handled by the page, which runs the text.
      { key: "Mod-Enter", run: () => true },
    ]);
    const state = EditorState.create({
      extensions: [
        steps,
        lineNumbers(),
        lintGutter(),
        autocompletion({ override: [completions(hooks)], icons: false }),
        highlightActiveLine(),
        EditorView.lineWrapping,
        StreamLanguage.define(toml),
        syntaxHighlighting(HIGHLIGHT),
        keymap.of([...completionKeymap, ...defaultKeymap, indentWithTab]),
        EditorView.contentAttributes.of({ "aria-label": "Text of the scenario", tabindex: "0" }),
        EditorView.updateListener.of((update) => {
          const isOurs = update.transactions.some((one) => one.docChanged && !one.annotation(EXTERNAL_CHANGE));
          if (isOurs) hooks.onChange(update.state.doc.toString());
        }),
        this.#locked.of([]),
        COLORS,
      ],
    });
    this.#view = new EditorView({ state, root, parent: frame });
  }

  get text(): string {
    return this.#view.state.doc.toString();
  }

  /** Sets the text; only the part that differs is replaced, and shown unless it is the first text. */
  setText(text: string, isLocked: boolean): void {
    const before = this.text;
    const effects = [this.#locked.reconfigure(isLocked ? [EditorState.readOnly.of(true)] : [])];
    if (text === before) return this.#view.dispatch({ effects });
    let from = 0;
    while (from < text.length && from < before.length && text[from] === before[from]) from++;
    let tail = 0;
    while (tail < Math.min(text.length, before.length) - from && text.at(-1 - tail) === before.at(-1 - tail)) tail++;
    const changes = { from, to: before.length - tail, insert: text.slice(from, text.length - tail) };
    const shows = before === "" ? {} : { selection: { anchor: text.length - tail }, scrollIntoView: true };
    this.#view.dispatch({ changes, effects, ...shows, annotations: EXTERNAL_CHANGE.of(true) });
  }

  /** Marks problems over their ranges; those without a line are marked on the first one. */
  mark(problems: readonly Problem[]): void {
    const { doc } = this.#view.state;
    const found = problems.map((problem): Diagnostic => {
      const from = this.#offset(problem.line ?? 1, problem.column ?? 1);
      const line = doc.lineAt(from);
      const word = /^[\w".-]+/.exec(line.text.slice(from - line.from))?.[0].length ?? 0;
      const last = problem.line === null ? line.to : Math.max(from + word, Math.min(line.to, from + 1));
      const hasEnd = problem.end_line != null && problem.end_column != null;
      const to = hasEnd ? Math.max(from, this.#offset(problem.end_line!, problem.end_column!)) : last;
      const message = problem.remedy ? `${problem.cause}\nRemedy: ${problem.remedy}` : problem.cause;
      return { from, to, severity: problem.is_warning ? "warning" : "error", message };
    });
    this.#view.dispatch(setDiagnostics(this.#view.state, found));
  }

  /** Returns the offset of a line and a column; both count from 1, columns in characters. */
  #offset(line: number, column: number): number {
    const { doc } = this.#view.state;
    const at = doc.line(Math.min(doc.lines, Math.max(1, line)));
    const units = [...at.text].slice(0, Math.max(0, column - 1)).join("").length;
    return Math.min(at.to, at.from + units);
  }

  /** Moves the cursor to a line and shows it. */
  goTo(line: number, column: number): void {
    const anchor = this.#offset(line, column);
    this.#view.dispatch({ selection: { anchor }, effects: EditorView.scrollIntoView(anchor, { y: "center" }) });
    this.#view.focus();
  }

  destroy(): void {
    this.#view.destroy();
  }
}
