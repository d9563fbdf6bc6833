# Figures: tables in, a PNG and its caption out. They are drawn again when warmslip.figures changes, and then alone.

# the report shows the caption that was written beside a figure; a template knows the configuration and nothing else
# through which it could read a file
CAPTION = "../report/caption.rst"
config["read"] = lambda path: Path(path).read_text()

BOTH_RUNS = expand(
    "<runs>/fields/{{reading}}_{theta}/trajectory.h5", theta=TEMPERATURES
)
BOTH_STUDIES = expand(
    "<runs>/studies/{{reading}}_{theta}_staggered.csv", theta=TEMPERATURES
)


rule figure_1:
    """The setting."""
    input:
        expand(
            "<runs>/fields/{reading}_{theta}/trajectory.h5",
            reading=READINGS[0],
            theta=TEMPERATURES,
        ),
    output:
        figure=report(
            "<paper>/figures/figure_1.png",
            caption=CAPTION,
            category="1 Setting",
            labels={"figure": "setting"},
        ),
        caption="<paper>/figures/figure_1.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw setting {input} --out {output.figure}"


rule figure_2:
    """Deformed configurations."""
    input:
        BOTH_RUNS,
    output:
        figure=report(
            "<paper>/figures/figure_2_{reading}.png",
            caption=CAPTION,
            category="2 Deformed configuration",
            labels={"reading": "{reading}"},
        ),
        caption="<paper>/figures/figure_2_{reading}.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw deformed {input} --out {output.figure}"


rule figure_3:
    """Temperature fields."""
    input:
        BOTH_RUNS,
    output:
        figure=report(
            "<paper>/figures/figure_3_{reading}.png",
            caption=CAPTION,
            category="3 Temperature",
            labels={"reading": "{reading}"},
        ),
        caption="<paper>/figures/figure_3_{reading}.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw temperature {input} --out {output.figure}"


rule figure_4:
    """Von Mises stress."""
    input:
        BOTH_RUNS,
    output:
        figure=report(
            "<paper>/figures/figure_4_{reading}.png",
            caption=CAPTION,
            category="4 Von Mises stress",
            labels={"reading": "{reading}"},
        ),
        caption="<paper>/figures/figure_4_{reading}.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw mises {input} --out {output.figure}"


rule figure_5:
    """Estimated errors, as the paper drew them."""
    input:
        BOTH_STUDIES,
    output:
        figure=report(
            "<paper>/figures/figure_5_{reading}.png",
            caption=CAPTION,
            category="5 Convergence",
            labels={"reading": "{reading}", "figure": "as in the paper"},
        ),
        caption="<paper>/figures/figure_5_{reading}.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw errors {input} --out {output.figure}"


rule orders:
    """Beside figure 5: orders with the bias of the self-reference removed, and those the problem is expected to."""
    input:
        "<paper>/rates.csv",
        BOTH_STUDIES,
    output:
        figure=report(
            "<paper>/figures/orders_{reading}.png",
            caption=CAPTION,
            category="5 Convergence",
            labels={"reading": "{reading}", "figure": "orders, bias removed"},
        ),
        caption="<paper>/figures/orders_{reading}.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw corrected {input} --out {output.figure}"


rule grid:
    """Errors with h and k refined separately."""
    input:
        BOTH_STUDIES,
    output:
        figure=report(
            "<paper>/figures/grid_{reading}.png",
            caption=CAPTION,
            category="5 Convergence",
            labels={"reading": "{reading}", "figure": "h and k separately"},
        ),
        caption="<paper>/figures/grid_{reading}.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw grid {input} --out {output.figure}"


rule work_figure:
    """Error against cost."""
    input:
        "<tradeoff>/work.csv",
    output:
        figure=report(
            "<tradeoff>/work.png",
            caption=CAPTION,
            category="6 Speed against accuracy",
            labels={"figure": "work and precision"},
        ),
        caption="<tradeoff>/work.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw work {input} --out {output.figure}"


rule extremes_figure:
    """Outcomes at the extremes."""
    input:
        "<runs>/extremes.csv",
    output:
        figure=report(
            "<extremes>/extremes.png",
            caption=CAPTION,
            category="7 Extremes",
            labels={"figure": "outcomes"},
        ),
        caption="<extremes>/extremes.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw extremes {input} --out {output.figure}"


rule blocks_figure:
    """What blocks cost."""
    input:
        "<runs>/blocks.csv",
    output:
        figure=report(
            "<tradeoff>/blocks.png",
            caption=CAPTION,
            category="6 Speed against accuracy",
            labels={"figure": "cost of blocks"},
        ),
        caption="<tradeoff>/blocks.rst",
    params:
        code=FIGURES,
    message:
        "figure {output.figure}"
    shell:
        "warmslip draw blocks {input} --out {output.figure}"


rule figures:
    input:
        "<paper>/figures/figure_1.png",
        expand(
            "<paper>/figures/figure_{number}_{reading}.png",
            number=[2, 3, 4, 5],
            reading=READINGS,
        ),
        expand(
            "<paper>/figures/{kind}_{reading}.png",
            kind=["orders", "grid"],
            reading=READINGS,
        ),
        "<tradeoff>/work.png",
        "<tradeoff>/blocks.png",
        "<extremes>/extremes.png",
