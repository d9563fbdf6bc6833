# The environment every command of the project runs in; to be sourced: `. workflows/env.sh`. Takes no time.
# A value that is already set is kept.
export PATH="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/.venv/bin:$PATH"

# one thread a process: parallelism is by processes
export OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:=1}"
export OMP_NUM_THREADS="${OMP_NUM_THREADS:=1}"

# Open MPI refuses root and more processes than cores unless told (the last line is for Open MPI 5)
export OMPI_ALLOW_RUN_AS_ROOT="${OMPI_ALLOW_RUN_AS_ROOT:=1}"
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="${OMPI_ALLOW_RUN_AS_ROOT_CONFIRM:=1}"
export OMPI_MCA_rmaps_base_oversubscribe="${OMPI_MCA_rmaps_base_oversubscribe:=1}"
export PRTE_MCA_rmaps_default_mapping_policy="${PRTE_MCA_rmaps_default_mapping_policy:=:oversubscribe}"
# a rank that waits gives way to others: without this two ranks on one free core are sixty times slower
export OMPI_MCA_mpi_yield_when_idle="${OMPI_MCA_mpi_yield_when_idle:=1}"
# a process started without mpirun does not look for a daemon (up to 5 s); no effect under mpirun
export OMPI_MCA_ess_singleton_isolated="${OMPI_MCA_ess_singleton_isolated:=1}"
