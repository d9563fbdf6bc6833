# Everything that solves. The long ones start first; each takes one core.


rule study:
    """Errors and costs over an h,k grid, measured against the finest member while all of them march."""
    output:
        table="<runs>/studies/{case}.csv",
        stamp="<runs>/studies/{case}.json",
    log:
        "<runs>/logs/study_{case}.log",
    priority: 100
    threads: 1
    resources:
        mem_mb=config["study_memory_mb"],
    params:
        scene=lambda wildcards: scene(wildcards.case),
        grid=lambda wildcards: CASES[wildcards.case],
        levels=numbers(config["levels"]),
        reference=config["reference"],
        core=FINGERPRINT,
        code=STUDYING,
    message:
        "study {wildcards.case}: {params.grid} grid, reference 1/{params.reference}"
    shell:
        "warmslip study {params.scene} --levels {params.levels} --reference {params.reference} --grid {params.grid}"
        " --out {output.table} > {log} 2>&1"


rule run:
    """One run of a reading, for figures 1-4; only the last state is kept."""
    output:
        trajectory="<runs>/fields/{reading}_{theta}/trajectory.h5",
        summary="<runs>/fields/{reading}_{theta}/summary.json",
    log:
        "<runs>/logs/run_{reading}_{theta}.log",
    priority: 50
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scene=lambda wildcards: scene(f"{wildcards.reading}_{wildcards.theta}"),
        n=config["figure_n"],
        core=FINGERPRINT,
    message:
        "run {wildcards.reading}, theta_F = {wildcards.theta}"
    shell:
        "warmslip run {params.scene} --set mesh.n={params.n} --set time.steps={params.n} --set output.every={params.n}"
        " --out $(dirname {output.trajectory}) > {log} 2>&1"


rule fields:
    """All runs. Figures 1-4 are committed and their runs are not: asked for here, a fresh clone makes both anew."""
    input:
        expand(
            "<runs>/fields/{reading}_{theta}/trajectory.h5",
            reading=READINGS,
            theta=TEMPERATURES,
        ),


rule manufactured:
    """Errors and orders on exact solutions with contact and slip."""
    output:
        table="<runs>/manufactured.csv",
        stamp="<runs>/manufactured.json",
    log:
        "<runs>/logs/manufactured.log",
    priority: 80
    threads: 1
    resources:
        mem_mb=1000,
    params:
        levels=numbers(config["manufactured_levels"]),
        core=FINGERPRINT,
        code=MEASURING,
    message:
        "errors on manufactured solutions"
    shell:
        "warmslip manufactured --levels {params.levels} --out {output.table} > {log} 2>&1"


rule extremes:
    """Ladders of data far outside the paper's: the outcome of every run."""
    output:
        table="<runs>/extremes.csv",
        stamp="<runs>/extremes.json",
    log:
        "<runs>/logs/extremes.log",
    priority: 80
    threads: 1
    resources:
        mem_mb=1000,
    params:
        n=config["extremes"]["n"],
        steps=config["extremes"]["steps"],
        core=FINGERPRINT,
        code=STUDYING,
    message:
        "runs at the extremes"
    shell:
        "warmslip extremes --n {params.n} --steps {params.steps} --out {output.table} > {log} 2>&1"


rule blocks:
    """Seconds of a step of every combination of blocks, and what `explain` says of the library against what its runs take."""
    output:
        table="<runs>/blocks.csv",
        stamp="<runs>/blocks.json",
        explained="<runs>/explained.csv",
        explained_stamp="<runs>/explained.json",
    log:
        "<runs>/logs/blocks.log",
    priority: 70
    threads: workflow.cores  # alone, so that nothing disturbs the clock
    resources:
        mem_mb=1000,
    params:
        n=config["blocks"]["n"],
        steps=config["blocks"]["steps"],
        core=FINGERPRINT,
        code=MEASURING,
    message:
        "cost of every combination of blocks"
    shell:
        "warmslip blocks --n {params.n} --steps {params.steps} --out {output.table}"
        " --explained {output.explained} > {log} 2>&1"
