/** The text of a scenario in CodeMirror. It lives in a shadow root, since there its styles need no inline element. */

import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { HighlightStyle, StreamLanguage, syntaxHighlighting } from "@codemirror/language";
import { toml } from "@codemirror/legacy-modes/mode/toml";
import { lintGutter, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { Compartment, EditorState } from "@codemirror/state";
import { EditorView, highlightActiveLine, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";
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
  changed(text: string): void;
  run(): void;
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
    const run = keymap.of([{ key: "Mod-Enter", run: () => (hooks.run(), true) }]);
    const state = EditorState.create({
      extensions: [
        run,
        lineNumbers(),
        lintGutter(),
        history(),
        highlightActiveLine(),
        EditorView.lineWrapping,
        StreamLanguage.define(toml),
        syntaxHighlighting(HIGHLIGHT),
        keymap.of([...defaultKeymap, ...historyKeymap, indentWithTab]),
        EditorView.contentAttributes.of({ "aria-label": "Text of the scenario" }),
        EditorView.updateListener.of((update) => {
          if (update.docChanged) hooks.changed(update.state.doc.toString());
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

  setText(text: string, isLocked: boolean): void {
    const changes = { from: 0, to: this.#view.state.doc.length, insert: text };
    const locks = isLocked ? [EditorState.readOnly.of(true)] : [];
    this.#view.dispatch({ changes, effects: this.#locked.reconfigure(locks) });
  }

  /** Marks problems where the server sees them; those without a line stand at the first. */
  mark(problems: readonly Problem[]): void {
    const { doc } = this.#view.state;
    const found = problems.map((problem): Diagnostic => {
      const line = doc.line(Math.min(doc.lines, Math.max(1, problem.line ?? 1)));
      const start = Math.min(line.to, line.from + Math.max(0, (problem.column ?? 1) - 1));
      const word = /^[\w".-]+/.exec(line.text.slice(start - line.from))?.[0].length ?? 0;
      const to = problem.line === null ? line.to : Math.max(start + word, Math.min(line.to, start + 1));
      const message = problem.remedy ? `${problem.cause}\nRemedy: ${problem.remedy}` : problem.cause;
      return { from: start, to, severity: problem.is_warning ? "warning" : "error", message };
    });
    this.#view.dispatch(setDiagnostics(this.#view.state, found));
  }

  /** Puts the cursor at a line and shows it. */
  goTo(line: number, column: number): void {
    const at = this.#view.state.doc.line(Math.min(this.#view.state.doc.lines, Math.max(1, line)));
    const anchor = Math.min(at.to, at.from + Math.max(0, column - 1));
    this.#view.dispatch({ selection: { anchor }, effects: EditorView.scrollIntoView(anchor, { y: "center" }) });
    this.#view.focus();
  }

  destroy(): void {
    this.#view.destroy();
  }
}
