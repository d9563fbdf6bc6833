# Plain `snakemake` reproduces the paper: its figures, tables, verdict. What is computed and how: workflows/Snakefile.
include: "workflows/Snakefile"


rule all:
    default_target: True
    input:
        rules.fields.input,
        rules.figures.input,
        rules.tables.input,
        rules.verdict.output,
        rules.page.output,
        rules.judged.output,
    message:
        "everything is there"
