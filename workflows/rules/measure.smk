# Tables from tables. No solver runs here.

STUDIES = expand("<runs>/studies/{case}.csv", case=CASES)


rule rates:
    """Observed, bias-corrected and expected orders of every study."""
    input:
        STUDIES,
    output:
        table="<paper>/rates.csv",
        stamp="<paper>/rates.json",
    params:
        code=MEASURING,
    message:
        "rates of all studies"
    shell:
        "warmslip rates {input} --out {output.table}"


rule readings:
    """Which reading of the paper satisfies which of its claims."""
    input:
        STUDIES,
    output:
        table="<paper>/readings.csv",
        stamp="<paper>/readings.json",
    params:
        code=MEASURING,
    message:
        "claims of the paper, reading by reading"
    shell:
        "warmslip readings {input} --out {output.table}"


rule work:
    """Error against cost of every run of every study, and the runs that nothing beats."""
    input:
        STUDIES,
    output:
        table="<tradeoff>/work.csv",
        stamp="<tradeoff>/work.json",
    params:
        code=MEASURING,
    message:
        "work and precision of all runs"
    shell:
        "warmslip work {input} --out {output.table}"


rule publish:
    """The tables of the solves, with their stamps, where they are committed."""
    input:
        studies=STUDIES,
        stamps=expand("<runs>/studies/{case}.json", case=CASES),
        manufactured=["<runs>/manufactured.csv", "<runs>/manufactured.json"],
        extremes=["<runs>/extremes.csv", "<runs>/extremes.json"],
        blocks=expand(
            "<runs>/{name}.{kind}", name=["blocks", "explained"], kind=["csv", "json"]
        ),
    output:
        studies=expand("<paper>/studies/{case}.csv", case=CASES),
        stamps=expand("<paper>/studies/{case}.json", case=CASES),
        manufactured=["<paper>/manufactured.csv", "<paper>/manufactured.json"],
        extremes=["<extremes>/extremes.csv", "<extremes>/extremes.json"],
        blocks=expand(
            "<tradeoff>/{name}.{kind}",
            name=["blocks", "explained"],
            kind=["csv", "json"],
        ),
    message:
        "tables and their stamps to where they are committed"
    shell:
        "cp {input.studies} {input.stamps} $(dirname {output.studies[0]})"
        " && cp {input.manufactured} $(dirname {output.manufactured[0]})"
        " && cp {input.extremes} $(dirname {output.extremes[0]})"
        " && cp {input.blocks} $(dirname {output.blocks[0]})"


rule tables:
    input:
        rules.rates.output,
        rules.readings.output,
        rules.work.output,
        rules.publish.output,
