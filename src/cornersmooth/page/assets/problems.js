// What is wrong with the program, and what is to check: the first thing that a reader sees.

class Problems {
  /** @param {Meta} meta @param {Record<string, Values>} arrays @param {(place: Place | null) => void} chosen */
  constructor(meta, arrays, chosen) {
    this.meta = meta;
    this.arrays = arrays;
    this.chosen = chosen;
    const box = element("problems");
    box.hidden = !meta.problems.length;
    const [title, list] = box.children;
    const wrong = meta.problems.filter((problem) => problem.severity === "error").length;
    title.textContent = wrong ? `${wrong} ${wrong === 1 ? "problem" : "problems"}` : "To check";
    this.buttons = meta.problems.map((problem, k) => {
      const button = made("button", "", `problem ${problem.severity}`);
      button.setAttribute("type", "button");
      button.setAttribute("aria-pressed", "false");
      button.append(made("b", problem.severity), made("span", problem.text), made("small", this.where(problem)));
      button.addEventListener("click", () => this.select(k));
      return button;
    });
    list.append(...this.buttons);
  }

  /** @param {Problem} problem */
  where({ nc_line: nc, cl_line: cl, code }) {
    return [nc ? `NC line ${nc}` : "", cl ? `${this.meta.origin} line ${cl}` : "", code].filter(Boolean).join(" · ");
  }

  /** @param {number} k place in the list; -1 for none */
  select(k) {
    this.buttons.forEach((button, other) => button.setAttribute("aria-pressed", String(other === k)));
    if (k < 0) return;
    const problem = this.meta.problems[k];
    const place = placeOfProblem(this.arrays, problem);
    this.chosen(place);
    const panel = [made("h2", this.where(problem)), ...(place ? [insetOf(this.meta, this.arrays, place)] : [])];
    element("panel").replaceChildren(...panel);
  }
}
