# docker build -t warmslip .
# docker run --rm --user "$(id -u)" -v "$PWD:/data" warmslip run paper_mixed --out first
FROM debian:12-slim
SHELL ["/bin/bash", "-euo", "pipefail", "-c"]

# the newest packages of Debian 12 are what is wanted
# hadolint ignore=DL3008
RUN apt-get update && \
    apt-get install -y --no-install-recommends ca-certificates git make && \
    rm -rf /var/lib/apt/lists/*

WORKDIR /opt/warmslip
COPY . .
# the package itself instead of the editable one, which a plain user could not rebuild
RUN make setup && \
    .venv/bin/python -m pip install --no-cache-dir --no-build-isolation --no-deps --force-reinstall . && \
    rm -rf build /root/.cache /var/lib/apt/lists/*

RUN useradd --uid 1000 --create-home warmslip && mkdir /data && chown warmslip /data
USER 1000
WORKDIR /data
ENV PATH=/opt/warmslip/.venv/bin:$PATH OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 \
    OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_ess_singleton_isolated=1
ENTRYPOINT ["warmslip"]
CMD ["--help"]
