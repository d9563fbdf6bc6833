# Measuring and judging are separate: the verdict is always written, and only the last rule fails.


rule verdict:
    """Rates, stored values and identities against their bands."""
    input:
        manufactured="<runs>/manufactured.csv",
        readings="<paper>/readings.csv",
        extremes="<runs>/extremes.csv",
        studies=STUDIES,
        expected=config["expected"],
    output:
        report(
            "<paper>/verdict.json", category="0 Verdict", labels={"table": "verdict"}
        ),
    params:
        studies=lambda wildcards, input: " ".join(
            f"--studies {path}" for path in input.studies
        ),
        code=MEASURING,
    message:
        "verdict: {output}"
    shell:
        "warmslip judge --manufactured {input.manufactured} --readings {input.readings}"
        " --extremes {input.extremes} {params.studies} --expected {input.expected} --out {output} --no-fail"


rule page:
    """The figures, the readings and the verdict on one page."""
    input:
        figures=rules.figures.input,
        readings="<paper>/readings.csv",
        verdict="<paper>/verdict.json",
        template=PACKAGE / "paper/templates/paper.html",
    output:
        "<paper>/report.html",
    params:
        code=digest("paper"),
    message:
        "the page: {output}"
    shell:
        "warmslip page {input.figures} --readings {input.readings} --verdict {input.verdict} --out {output}"


rule judged:
    """Fails when the verdict did."""
    input:
        "<paper>/verdict.json",
    output:
        touch("<runs>/judged"),
    message:
        "is the verdict right?"
    shell:
        'python -c \'import json, sys; sys.exit(0 if json.load(open(sys.argv[1]))["passed"]'
        ' else "the verdict failed: read " + sys.argv[1])\' {input}'
