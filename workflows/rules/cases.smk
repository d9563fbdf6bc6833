# What is computed: a case is a study, named reading_theta_coupling or reading_theta_coupling_quadrature.

from warmslip.records.provenance import PACKAGE, fingerprint

READINGS = config["readings"]
TEMPERATURES = config["foundation_temperatures"]
FINGERPRINT = fingerprint()


def digest(*folders: str) -> str:
    """A hash of the Python files of some packages."""
    return hashlib.sha256(
        b"".join(
            path.read_bytes()
            for name in folders
            for path in sorted((PACKAGE / name).rglob("*.py"))
        )
    ).hexdigest()[:16]


MEASURING = digest("studies", "paper", "verification", "cli")
STUDYING = digest("studies")
FIGURES = digest("figures")

# grid of every case: full, or diagonal (h = k)
CASES = {
    f"{reading}_{theta}_{coupling}": grid
    for coupling, grid in config["couplings"].items()
    for reading in READINGS
    for theta in TEMPERATURES
} | {
    f"{case}_{quadrature}": "diagonal"
    for case, quadrature in config["quadratures"].items()
}


def scene(case: str) -> str:
    """The scene of a case and its overrides, as `warmslip run` and `warmslip study` take them."""
    reading, theta, *more = case.split("_")
    keys = ("time.coupling", "contact.quadrature")
    chosen = {"contact.heat_exchange.foundation_temperature": theta} | dict(
        zip(keys, more)
    )
    return f"paper_{reading} " + " ".join(
        f"--set {key}={value}" for key, value in chosen.items()
    )


def numbers(values: list) -> str:
    return ",".join(map(str, values))


wildcard_constraints:
    reading="[a-z]+",
    theta="[0-9]+",
