#include "warmslip/fem/layout.hpp"

#include <petscdmplex.h>
#include <petscsf.h>

#include <algorithm>
#include <string_view>

namespace warmslip {
namespace {

using DmHandle = Handle<DM, DMDestroy>;
using SfHandle = Handle<PetscSF, PetscSFDestroy>;
using SectionHandle = Handle<PetscSection, PetscSectionDestroy>;

// One integer on every point of the plex: its number in the mesh.
SectionHandle point_section(DM dm) {
  SectionHandle section;
  PetscInt begin, end;
  WARMSLIP_PETSC(DMPlexGetChart(dm, &begin, &end));
  WARMSLIP_PETSC(PetscSectionCreate(PetscObjectComm(reinterpret_cast<PetscObject>(dm)), section.out()));
  WARMSLIP_PETSC(PetscSectionSetChart(section, begin, end));
  for (PetscInt p = begin; p < end; ++p) WARMSLIP_PETSC(PetscSectionSetDof(section, p, 1));
  WARMSLIP_PETSC(PetscSectionSetUp(section));
  return section;
}

}  // namespace

template <int d>
Layout<d>::Layout(MPI_Comm comm, std::shared_ptr<const Mesh<d>> mesh) : mesh_(std::move(mesh)) {
  WARMSLIP_PETSC(PetscCommDuplicate(comm, &comm_, nullptr));
  std::vector<PetscInt> owners;  // of local nodes; -1 is this rank
  partition(mesh_cells_, owners);

  // owned nodes first, each group in mesh order
  std::vector<Index> ordered;
  const auto nodes = static_cast<std::size_t>(mesh_->nodes.rows());
  std::vector<std::pair<Index, bool>> present;  // mesh node, ghost
  for (std::size_t i = 0; i < mesh_nodes_.size(); ++i) present.emplace_back(mesh_nodes_[i], owners[i] >= 0);
  std::sort(present.begin(), present.end(),
            [](auto a, auto b) { return std::pair(a.second, a.first) < std::pair(b.second, b.first); });
  owned_ = static_cast<PetscInt>(std::count_if(present.begin(), present.end(), [](auto p) { return !p.second; }));
  std::vector<Index> local_of_mesh(nodes, -1);
  for (std::size_t i = 0; i < present.size(); ++i) {
    mesh_nodes_[i] = present[i].first;
    local_of_mesh[static_cast<std::size_t>(present[i].first)] = static_cast<Index>(i);
  }

  cells_.resize(static_cast<Eigen::Index>(mesh_cells_.size()), d + 1);
  local_of_cell_.assign(static_cast<std::size_t>(mesh_->cells.rows()), -1);
  for (std::size_t c = 0; c < mesh_cells_.size(); ++c) {
    local_of_cell_[static_cast<std::size_t>(mesh_cells_[c])] = static_cast<Index>(c);
    for (int i = 0; i <= d; ++i)
      cells_(static_cast<Eigen::Index>(c), i) =
          local_of_mesh[static_cast<std::size_t>(mesh_->cells(mesh_cells_[c], i))];
  }

  // PETSc's numbering: contiguous by rank, in the order of the owned nodes. The mesh is replicated, so is this map.
  PetscInt first = 0;
  MPI_Exscan(&owned_, &first, 1, MPIU_INT, MPI_SUM, comm_);
  std::vector<PetscInt> mine(nodes, 0);
  for (PetscInt i = 0; i < owned_; ++i)
    mine[static_cast<std::size_t>(mesh_nodes_[static_cast<std::size_t>(i)])] = first + i;
  global_of_mesh_.resize(nodes);
  MPI_Allreduce(mine.data(), global_of_mesh_.data(), static_cast<int>(nodes), MPIU_INT, MPI_SUM, comm_);
  for (const Index node : mesh_nodes_) global_nodes_.push_back(global_of(node));
  count_neighbours();
}

template <int d>
Layout<d>::~Layout() {
  int size;
  MPI_Comm_size(comm_, &size);
  if (size == 1) PetscCommDestroy(&comm_);
}

// DMPlex decides which rank holds which cell and which of the sharing ranks owns a node.
template <int d>
void Layout<d>::partition(std::vector<Index>& cells, std::vector<PetscInt>& owners) {
  int rank, size;
  MPI_Comm_rank(comm_, &rank);
  MPI_Comm_size(comm_, &size);
  if (size == 1) {
    cells.resize(static_cast<std::size_t>(mesh_->cells.rows()));
    mesh_nodes_.resize(static_cast<std::size_t>(mesh_->nodes.rows()));
    for (std::size_t c = 0; c < cells.size(); ++c) cells[c] = static_cast<Index>(c);
    for (std::size_t i = 0; i < mesh_nodes_.size(); ++i) mesh_nodes_[i] = static_cast<Index>(i);
    owners.assign(mesh_nodes_.size(), -1);
    return;
  }
  const bool root = rank == 0;
  const std::vector<PetscInt> corners(mesh_->cells.data(), mesh_->cells.data() + (root ? mesh_->cells.size() : 0));
  const auto cell_count = static_cast<PetscInt>(root ? mesh_->cells.rows() : 0);
  const auto node_count = static_cast<PetscInt>(root ? mesh_->nodes.rows() : 0);
  DmHandle serial, distributed;
  WARMSLIP_PETSC(DMPlexCreateFromCellListPetsc(comm_, d, cell_count, node_count, d + 1, PETSC_TRUE, corners.data(), d,
                                               mesh_->nodes.data(), serial.out()));
  WARMSLIP_PETSC(DMSetOptionsPrefix(serial, "mesh_"));
  WARMSLIP_PETSC(DMPlexDistributeSetDefault(serial, PETSC_FALSE));  // options must not distribute it behind our back
  WARMSLIP_PETSC(DMSetFromOptions(serial));
  const SectionHandle before = point_section(serial);
  PetscInt begin, end, chart;
  WARMSLIP_PETSC(PetscSectionGetChart(before, nullptr, &chart));
  std::vector<PetscInt> numbers(static_cast<std::size_t>(chart), -1);  // edges and faces keep the -1
  const auto count_from_first = [&](PetscInt first, PetscInt last) {
    for (PetscInt p = first; p < last; ++p) numbers[static_cast<std::size_t>(p)] = p - first;
  };
  WARMSLIP_PETSC(DMPlexGetHeightStratum(serial, 0, &begin, &end));
  count_from_first(begin, end);
  WARMSLIP_PETSC(DMPlexGetDepthStratum(serial, 0, &begin, &end));
  count_from_first(begin, end);
  SfHandle migration;
  WARMSLIP_PETSC(DMPlexDistribute(serial, 0, migration.out(), distributed.out()));

  SectionHandle after;
  PetscInt* moved = nullptr;
  WARMSLIP_PETSC(PetscSectionCreate(comm_, after.out()));
  WARMSLIP_PETSC(DMPlexDistributeData(serial, migration, before, MPIU_INT, numbers.data(), after,
                                      reinterpret_cast<void**>(&moved)));
  const auto number = [&](PetscInt point) {
    PetscInt offset;
    WARMSLIP_PETSC(PetscSectionGetOffset(after, point, &offset));
    return static_cast<Index>(moved[offset]);
  };
  WARMSLIP_PETSC(DMPlexGetHeightStratum(distributed, 0, &begin, &end));
  for (PetscInt p = begin; p < end; ++p) cells.push_back(number(p));
  WARMSLIP_PETSC(DMPlexGetDepthStratum(distributed, 0, &begin, &end));
  for (PetscInt p = begin; p < end; ++p) mesh_nodes_.push_back(number(p));
  owners.assign(mesh_nodes_.size(), -1);
  PetscSF shared;
  PetscInt leaves;
  const PetscInt* local;
  const PetscSFNode* remote;
  WARMSLIP_PETSC(DMGetPointSF(distributed, &shared));
  WARMSLIP_PETSC(PetscSFGetGraph(shared, nullptr, &leaves, &local, &remote));
  for (PetscInt leaf = 0; leaf < leaves; ++leaf) {
    const PetscInt point = local ? local[leaf] : leaf;
    if (point >= begin && point < end)
      owners[static_cast<std::size_t>(point - begin)] = static_cast<PetscInt>(remote[leaf].rank);
  }
  WARMSLIP_PETSC(PetscFree(moved));
}

template <int d>
void Layout<d>::count_neighbours() {
  const auto nodes = mesh_nodes_.size();
  std::vector<std::vector<Index>> neighbours(nodes);
  for (Eigen::Index c = 0; c < cells_.rows(); ++c)
    for (int i = 0; i <= d; ++i)
      for (int j = 0; j <= d; ++j) neighbours[static_cast<std::size_t>(cells_(c, i))].push_back(cells_(c, j));
  const VecHandle counts = vector(1);
  Eigen::VectorXd known(static_cast<Eigen::Index>(nodes));
  diagonal_.assign(static_cast<std::size_t>(owned_), 0);
  off_diagonal_ = diagonal_;
  for (std::size_t i = 0; i < nodes; ++i) {
    auto& list = neighbours[i];
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    if (i < static_cast<std::size_t>(owned_)) {
      const auto split = std::lower_bound(list.begin(), list.end(), static_cast<Index>(owned_)) - list.begin();
      diagonal_[i] = static_cast<PetscInt>(split);
      off_diagonal_[i] = static_cast<PetscInt>(static_cast<std::ptrdiff_t>(list.size()) - split);
    } else {  // what this rank knows of a neighbour's node
      const PetscInt row = global_nodes_[i];
      WARMSLIP_PETSC(VecSetValue(counts, row, static_cast<double>(list.size()), ADD_VALUES));
    }
  }
  WARMSLIP_PETSC(VecAssemblyBegin(counts));
  WARMSLIP_PETSC(VecAssemblyEnd(counts));
  Values elsewhere(counts);
  PetscInt total = 0;
  WARMSLIP_PETSC(VecGetSize(counts, &total));
  for (PetscInt i = 0; i < owned_; ++i) {
    const auto more = static_cast<PetscInt>((*elsewhere)[i]);
    auto& near = diagonal_[static_cast<std::size_t>(i)];
    auto& far = off_diagonal_[static_cast<std::size_t>(i)];
    near = std::min(near + more, owned_);
    far = std::min(far + more, total - owned_);
  }
}

template <int d>
VecHandle Layout<d>::vector(int block) const {
  VecHandle v;
  const auto ghosts = static_cast<PetscInt>(global_nodes_.size()) - owned_;
  WARMSLIP_PETSC(VecCreateGhostBlock(comm_, block, owned_ * block, PETSC_DETERMINE, ghosts,
                                     global_nodes_.data() + owned_, v.out()));
  WARMSLIP_PETSC(VecSet(v, 0));
  return v;
}

template <int d>
MatHandle Layout<d>::matrix(int rows, int cols, MatType type) const {
  MatHandle a;
  WARMSLIP_PETSC(MatCreate(comm_, a.out()));
  WARMSLIP_PETSC(MatSetSizes(a, owned_ * rows, owned_ * cols, PETSC_DETERMINE, PETSC_DETERMINE));
  WARMSLIP_PETSC(MatSetBlockSizes(a, rows, cols));
  WARMSLIP_PETSC(MatSetType(a, type));
  std::vector<PetscInt> near, far;
  for (PetscInt i = 0; i < owned_; ++i)
    for (int r = 0; r < rows; ++r) {
      near.push_back(diagonal_[static_cast<std::size_t>(i)] * cols);
      far.push_back(off_diagonal_[static_cast<std::size_t>(i)] * cols);
    }
  WARMSLIP_PETSC(MatSeqAIJSetPreallocation(a, 0, near.data()));
  WARMSLIP_PETSC(MatMPIAIJSetPreallocation(a, 0, near.data(), 0, far.data()));
  WARMSLIP_PETSC(MatSeqBAIJSetPreallocation(a, rows, 0, diagonal_.data()));
  WARMSLIP_PETSC(MatMPIBAIJSetPreallocation(a, rows, 0, diagonal_.data(), 0, off_diagonal_.data()));
  if (std::string_view(type) == MATAIJ)  // for rows this short the plain product is twice as fast
    WARMSLIP_PETSC(MatSetOption(a, MAT_USE_INODES, PETSC_FALSE));
  return a;
}

template <int d>
void Layout<d>::add(Mat a, Eigen::Index cell, const double* block) const {
  std::array<PetscInt, d + 1> nodes;
  for (int i = 0; i <= d; ++i)
    nodes[static_cast<std::size_t>(i)] = global_nodes_[static_cast<std::size_t>(cells_(cell, i))];
  WARMSLIP_PETSC(MatSetValuesBlocked(a, d + 1, nodes.data(), d + 1, nodes.data(), block, ADD_VALUES));
}

template <int d>
void Layout<d>::assemble(Mat a) {
  WARMSLIP_PETSC(MatAssemblyBegin(a, MAT_FINAL_ASSEMBLY));
  WARMSLIP_PETSC(MatAssemblyEnd(a, MAT_FINAL_ASSEMBLY));
}

template <int d>
Eigen::VectorXd Layout<d>::local(Vec v) const {
  WARMSLIP_PETSC(VecGhostUpdateBegin(v, INSERT_VALUES, SCATTER_FORWARD));
  WARMSLIP_PETSC(VecGhostUpdateEnd(v, INSERT_VALUES, SCATTER_FORWARD));
  Vec form;
  WARMSLIP_PETSC(VecGhostGetLocalForm(v, &form));
  Eigen::VectorXd values = *Values(form);
  WARMSLIP_PETSC(VecGhostRestoreLocalForm(v, &form));
  return values;
}

template <int d>
Eigen::VectorXd Layout<d>::gather(Vec v) const {
  const Eigen::Index block = block_size(v);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(mesh_->nodes.rows() * block);
  {
    Values owned(v);
    for (PetscInt i = 0; i < owned_; ++i)
      all.segment(mesh_nodes_[static_cast<std::size_t>(i)] * block, block) = (*owned).segment(i * block, block);
  }
  return sum(std::move(all));  // every node has one owner
}

template <int d>
void Layout<d>::distribute(const Eigen::VectorXd& values, Vec v) const {
  const Eigen::Index block = block_size(v);
  if (values.size() != mesh_->nodes.rows() * block)
    throw std::invalid_argument("expected " + std::to_string(block) + " values for each of the " +
                                std::to_string(mesh_->nodes.rows()) + " nodes, got " + std::to_string(values.size()) +
                                " in all");
  Values owned(v);
  for (PetscInt i = 0; i < owned_; ++i)
    (*owned).segment(i * block, block) = values.segment(mesh_nodes_[static_cast<std::size_t>(i)] * block, block);
}

template <int d>
double Layout<d>::sum(double value) const {
  double total = 0;
  MPI_Allreduce(&value, &total, 1, MPI_DOUBLE, MPI_SUM, comm_);
  return total;
}

template <int d>
Eigen::VectorXd Layout<d>::sum(Eigen::VectorXd values) const {
  MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_SUM, comm_);
  return values;
}

template class Layout<2>;
template class Layout<3>;

}  // namespace warmslip
