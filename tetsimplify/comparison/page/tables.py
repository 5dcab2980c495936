"""The parts of the page that are there without a script: words and tables."""

from __future__ import annotations

from html import escape

from tetsimplify.comparison.page.model import (
    Case,
    Comparison,
    Run,
    has_mesh,
    is_kept,
)
from tetsimplify.comparison.page.wording import NONE, counted, listing, short, whole


def lede(comparison: Comparison) -> str:
    """What was compared and what came out, in two sentences."""
    methods, cases = comparison.methods, comparison.cases
    kept = comparison.methods_that_always_keep()
    others = len(methods) - len(kept)
    sizes = len({case.criterion for case in cases})
    what = (
        f"{counted(len(comparison.inputs), 'surface')}, {counted(len(methods), 'method')}, "
        f"{counted(sizes, 'size')}: {counted(len(comparison.runs), 'run')}."
    )
    if not kept:
        return f"{what} No method kept the topology in every run."
    if not others:
        return f"{what} Every method kept the topology in every run."
    names = "; ".join(f"<strong>{escape(run['title'])}</strong>" for run in kept)
    rest = "The other one did" if others == 1 else f"The other {others} did"
    return f"{what} The topology was kept in every run by {names}. {rest} not."


def verdicts(comparison: Comparison) -> str:
    """Who kept the topology: a row for each method, a column for each input and criterion."""
    cases = comparison.cases
    runs_of = {case: comparison.runs_of(case) for case in cases}
    inputs = list(dict.fromkeys(case.input for case in cases))
    spans = [
        f'<th scope="colgroup" colspan="{sum(case.input == name for case in cases)}" '
        f'class="first">{escape(name)}</th>'
        for name in inputs
    ]
    starts = {next(case for case in cases if case.input == name) for name in inputs}

    def first(case: Case) -> str:
        return ' class="first"' if case in starts else ""

    heads = [f'<th scope="col"{first(case)}>{escape(case.name)}</th>' for case in cases]
    rows = []
    for method in comparison.methods:
        cells = [
            f"<td{first(case)}>{_verdict(comparison, runs_of[case].get(method['method']))}</td>"
            for case in cases
        ]
        rows.append(f'<tr><th scope="row">{swatch(method)}</th>{"".join(cells)}</tr>')
    return (
        '<table class="verdicts"><caption class="unseen">Whether each method kept the topology'
        "</caption><thead>"
        f'<tr><th rowspan="2" scope="col">Method</th>{"".join(spans)}</tr>'
        f"<tr>{''.join(heads)}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    )


def absent(comparison: Comparison) -> str:
    """The methods whose packages are not installed, and how to install them."""
    items = [
        f"<li><strong>{escape(entry['title'])}</strong>: not installed; "
        f"<code>{escape(entry['install'])}</code></li>"
        for entry in comparison.absent
    ]
    return f'<ul class="failures">{"".join(items)}</ul>' if items else ""


def failures(comparison: Comparison) -> str:
    """Every run that did not go as asked, with what was said."""
    items = [
        f"<li><strong>{escape(title)}</strong>, {escape(name)} at {escape(listing(criteria))}: "
        f"{escape(status)}{escape(f' ({message})' if message else '')}</li>"
        for (title, name, status, message), criteria in comparison.failures.items()
    ]
    if not items:
        return "<p>Every run ended with a mesh of the size asked for.</p>"
    return f'<ul class="failures">{"".join(items)}</ul>'


def methods(comparison: Comparison) -> str:
    """Where each method comes from."""
    rows = "".join(
        f'<tr><th scope="row">{escape(run["title"])}</th>'
        + "".join(
            f"<td>{escape(str(run.get(name) or NONE))}</td>"
            for name in ("package", "version", "licence", "precision")
        )
        + "</tr>"
        for run in comparison.methods
    )
    return (
        '<table><thead><tr><th scope="col">Method</th><th scope="col">Package</th>'
        '<th scope="col">Version</th><th scope="col">Licence</th><th scope="col">Precision</th>'
        f"</tr></thead><tbody>{rows}</tbody></table>"
    )


def short_lengths(comparison: Comparison) -> str:
    """Below what an edge of each input counts as short."""
    lengths = {run["input"]: run.get("short_length") for run in comparison.runs if has_mesh(run)}
    told = [f"{escape(name)} {short(value)}" for name, value in lengths.items() if value]
    return f": {', '.join(told)}" if told else ""


def machine(comparison: Comparison) -> str:
    """What it ran on."""
    told = comparison.machine
    entries = [
        ("Measured", comparison.created),
        ("Processor", told.get("processor")),
        ("Cores", told.get("cores")),
        ("Memory", told.get("memory_bytes") and f"{told['memory_bytes'] / 2**30:.0f} GiB"),
        ("System", told.get("platform")),
        ("Python", told.get("python")),
        ("Packages", ", ".join(f"{n} {v}" for n, v in (told.get("packages") or {}).items())),
    ]
    rows = (f"<dt>{name}</dt><dd>{escape(str(value))}</dd>" for name, value in entries if value)
    return f"<dl>{''.join(rows)}</dl>"


def swatch(run: Run) -> str:
    """The title of a method, with a spot of its colour in the charts."""
    return (
        f'<span class="swatch" data-method="{escape(run["method"])}"></span>{escape(run["title"])}'
    )


def _verdict(comparison: Comparison, number: int | None) -> str:
    if number is None:
        return '<span class="none" title="not run">·</span>'
    run = comparison.runs[number]
    if not has_mesh(run):
        why = escape(f"{run['status']}: {run.get('message') or ''}".removesuffix(": "))
        name = "n/a" if run["status"] == "not applicable" else escape(run["status"])
        return f'<span class="failed" title="{why}">{name}</span>'
    if is_kept(run):
        kind, text, told = "kept", "✓", "topology kept"
    else:
        kind, told = "broken", ", ".join(run["why_not"]) or "topology changed"
        n = run["n_violating_edges"]
        text = whole(n) if n else "χ" if "Euler" in told else "≠"
    note = " †" if run["status"] == "wrong count" else ""
    told += f"; {run['message']}" if note and run.get("message") else ""
    return (
        f'<button type="button" class="{kind}" data-run="{number}" title="{escape(told)}">'
        f'<span aria-hidden="true">{text}{note}</span><span class="unseen">{escape(told)}</span>'
        "</button>"
    )
