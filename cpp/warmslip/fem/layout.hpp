// Who owns what: a mesh distributed over the ranks of a communicator by DMPlex, and its node numbering.
#pragma once
#include "warmslip/la/petsc.hpp"
#include "warmslip/mesh/mesh.hpp"

namespace warmslip {

/// Nodes are numbered three ways: by the mesh (0..nodes), locally (owned first, then ghosts), and globally (PETSc's,
/// contiguous by rank). A vector with block size b holds entry (node*b + component). On one rank all three agree.
template <int d>
class Layout {
 public:
  Layout(MPI_Comm comm, std::shared_ptr<const Mesh<d>> mesh);
  ~Layout();
  Layout(const Layout&) = delete;

  MPI_Comm comm() const { return comm_; }
  const Mesh<d>& mesh() const { return *mesh_; }
  Eigen::Index cells() const { return cells_.rows(); }
  const IndexTable<d + 1>& local_cells() const { return cells_; }       ///< (cells, d+1) local nodes
  const std::vector<Index>& mesh_cells() const { return mesh_cells_; }  ///< mesh number of every local cell
  const std::vector<Index>& mesh_nodes() const { return mesh_nodes_; }  ///< mesh number of every local node
  const std::vector<PetscInt>& global_nodes() const { return global_nodes_; }
  PetscInt owned() const { return owned_; }
  PetscInt global_of(Index mesh_node) const { return global_of_mesh_[static_cast<std::size_t>(mesh_node)]; }
  bool owns_cell(Index mesh_cell) const { return local_of_cell_[static_cast<std::size_t>(mesh_cell)] >= 0; }
  Index local_cell(Index mesh_cell) const { return local_of_cell_[static_cast<std::size_t>(mesh_cell)]; }

  /// A zero vector of block size `block`, ghosted.
  VecHandle vector(int block) const;
  /// An empty matrix of the P1 sparsity, `rows` x `cols` unknowns a node, preallocated; in square blocks with MATBAIJ.
  MatHandle matrix(int rows, int cols, MatType type = MATAIJ) const;
  /// Adds a dense element block to `a`; finish with `assemble`.
  void add(Mat a, Eigen::Index cell, const double* row_major_block) const;
  static void assemble(Mat a);

  /// Local values (owned and ghosts) of a ghosted vector.
  Eigen::VectorXd local(Vec v) const;
  /// The whole vector in mesh numbering, on every rank.
  Eigen::VectorXd gather(Vec v) const;
  /// Sets `v` from an array in mesh numbering.
  void distribute(const Eigen::VectorXd& values, Vec v) const;
  /// Sum over the ranks.
  double sum(double value) const;
  Eigen::VectorXd sum(Eigen::VectorXd values) const;

 private:
  void partition(std::vector<Index>& cells, std::vector<PetscInt>& owners_of_nodes);
  void count_neighbours();

  // PETSc's duplicate of the caller's. With several ranks it is never given back: freeing it is collective, and ranks
  // may destroy a layout at different times.
  MPI_Comm comm_ = MPI_COMM_NULL;
  std::shared_ptr<const Mesh<d>> mesh_;
  IndexTable<d + 1> cells_;
  std::vector<Index> mesh_cells_, mesh_nodes_, local_of_cell_;
  std::vector<PetscInt> global_nodes_, global_of_mesh_;
  std::vector<PetscInt> diagonal_, off_diagonal_;  // P1 neighbours of every owned node, upper bounds
  PetscInt owned_ = 0;
};

}  // namespace warmslip
