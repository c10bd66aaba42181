"""Changes of the explorer's page as a hand makes them, and how long each takes until all is drawn."""

from __future__ import annotations

from typing import Any

#: Time from a change until the browser has drawn it and is idle again [ms].
TIMED = """
const [code, done] = [arguments[0], arguments[arguments.length - 1]];
const doc = Bokeh.documents[0], model = (name) => doc.get_model_by_name(name);
const frame = () => new Promise(requestAnimationFrame), pause = () => new Promise((r) => setTimeout(r, 0));
(async () => {
  await frame(); await pause();
  const begun = performance.now();
  new Function("model", code)(model);
  await frame(); await frame(); await pause();
  done(performance.now() - begun);
})();
"""
#: Changes of the page by the number of the change: what a hand does with filter, front, view and lines.
CHANGES = {
    "filter": "model('filter effects.crowning.amount').value = [0.05 * i, 7.1]",
    "brush": "model('filter pair.helix_angle').value = [-1, 4 + 0.15 * i]",
    "pick": "const d = model('designs').data, k = 911 * i;"
    "model('pick').data = { design: [k], x: [d.x[k]], y: [d.y[k]] }",
    "pan": "const r = model('cloud').x_range, s = i < 30 ? 0.1 : -0.1; r.setv({ start: r.start + s, end: r.end + s })",
    "box": "const e = model('designs').explore, r = model('cloud').x_range; e.marks += 1;"
    "r.setv({ start: r.start + 1e-6 }); e.area = { type: 'rect', x0: 7 + 0.1 * i, x1: 16, y0: 0.2, y1: 3 }",
}
TIMES = 60


def change_times(driver: Any) -> dict[str, list[float]]:
    """Times [ms] of ``TIMES`` changes of each kind."""
    return {
        name: [driver.execute_async_script(TIMED, f"const i = {i}; {code}") for i in range(TIMES)]
        for name, code in CHANGES.items()
    }
