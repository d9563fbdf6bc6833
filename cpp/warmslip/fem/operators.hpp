// The constant matrices of a problem, assembled once, and the quadratures that turn data into load vectors.
#pragma once
#include <optional>

#include "warmslip/fem/layout.hpp"
#include "warmslip/la/factor.hpp"
#include "warmslip/mesh/quadrature.hpp"
#include "warmslip/physics/p1.hpp"
#include "warmslip/physics/problem.hpp"

namespace warmslip {

/// Matrices in the paper's letters, without boundary conditions; those of absent blocks are null. w and u have block
/// size d, theta 1.
template <int d>
struct Operators {
  Operators(const Layout<d>& layout, const Problem<d>& problem);

  MatHandle inertia;       ///< rho (w, v), one scalar matrix for all components
  MatHandle springs;       ///< int v . S u over parts on springs
  MatHandle dashpots;      ///< int v . S w over parts on dashpots
  MatHandle elasticity;    ///< a(u, v), springs included
  MatHandle viscosity;     ///< b(w, v), dashpots included
  MatHandle mass;          ///< (theta, eta) times the capacity, lumped where the problem says so
  MatHandle conductivity;  ///< d(theta, eta)
  MatHandle expansion;     ///< m(theta, v): rows v, columns theta
  MatHandle heating;       ///< e(w, eta): rows eta, columns w
  MatHandle exchange;      ///< int k_c theta eta over Gamma_C, as the mass
  VecHandle reference;     ///< m(reference temperature, v); null where that is 0
  /// The reference temperature where all regions that expand have one: what they expand by is then computed from its
  /// difference to theta, which has no rounding of the two. Else 0, and the `reference` is a load.
  double common_reference = 0;
  std::vector<PetscInt> prescribed_displacement;  ///< global scalar indices with given displacement, owned by this rank
  /// Nodes that are held in directions beside the axes, the same on every rank; `held` leaves out what is prescribed by
  /// component.
  std::vector<HeldNode<d>> inclined;
  std::vector<PetscInt> prescribed_temperature;  ///< global nodes with given temperature, owned by this rank
};

/// rho M / k + B + k A with the rows and columns of prescribed displacements replaced by the identity. At an inclined
/// node with the projector P, its rows and columns are multiplied by I - P, and s P is added, s being of the size of
/// the node's own entries.
template <int d>
MatHandle momentum_matrix(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators, double k);

/// M / k + D + J with the rows and columns of prescribed temperatures replaced by the identity.
template <int d>
MatHandle heat_matrix(const Operators<d>& operators, double k);

/// Both in one, with block size d+1, (w, theta) a node: [K, -G; -scale E, scale H], for the monolithic coupling.
template <int d>
MatHandle coupled_matrix(const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators, double k,
                         double scale);

/// The scale of the heat rows with which the coupled matrix is symmetric, if there is one, and what it then is.
template <int d>
std::pair<double, Symmetry> coupled_symmetry(const Problem<d>& problem);

/// Quadrature points of the rank's cells or of the facets of a part, and the load vector of data given there.
template <int d>
class LoadQuadrature {
 public:
  /// Volume when `part` is empty. `points` per direction (exact to degree 2 points - 1), 0 for the vertices.
  LoadQuadrature(const Layout<d>& layout, const std::optional<std::string>& part, int points);

  RealTable<d> positions() const { return positions_; }  ///< (points, d)
  /// int f . v with f (points, components) of block size `components`.
  VecHandle load(const RealTable<Eigen::Dynamic>& values) const;
  /// Squared L2 distance of the P1 function `field` to `values`, summed over the ranks.
  double squared_distance(Vec field, const RealTable<Eigen::Dynamic>& values) const;
  /// Squared distance of eps(field) to the symmetric part of the gradients `values` (points, d*d), d/dx_j of component
  /// i at i*d+j.
  double squared_strain_distance(Vec field, const RealTable<Eigen::Dynamic>& values) const;

 private:
  void expect(const RealTable<Eigen::Dynamic>& values, Vec field, Eigen::Index components) const;

  const Layout<d>& layout_;
  Rule rule_;
  RealTable<d> positions_;
  IndexTable<Eigen::Dynamic> nodes_;  // local nodes of every cell or facet
  std::vector<Eigen::Index> cells_;   // local cell of every cell or facet
  Eigen::VectorXd measures_;
};

/// Exact norms of P1 functions; the geometry is computed once.
template <int d>
class Norms {
 public:
  explicit Norms(const Layout<d>& layout);
  /// |v|_L2 of a scalar or a vector field.
  double l2(Vec v) const;
  /// |v|_V = |eps(v)|_L2 of a displacement.
  double v(Vec v) const;

 private:
  template <int block>
  double squared_l2(const Eigen::VectorXd& local) const;

  const Layout<d>& layout_;
  std::vector<Simplex<d>> cells_;
};

/// The largest |A eps(u) + B eps(w) - M (theta - reference)| of a cell (Frobenius norm) for given fields, null where
/// there is none, and the largest that u and w of these sizes could have (collective).
struct StressSize {
  double largest = 0, possible = 0;
};
template <int d>
StressSize stress_size(const Layout<d>& layout, const Problem<d>& problem, Vec u, Vec w, Vec theta = nullptr);

}  // namespace warmslip
