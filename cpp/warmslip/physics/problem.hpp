// A problem: a mesh, its materials, its supports and its contact parts. Values only; what is absent is no part of the
// problem: no field, no matrix, no solve.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "warmslip/mesh/mesh.hpp"
#include "warmslip/physics/contact_law.hpp"
#include "warmslip/physics/supports.hpp"

namespace warmslip {

/// What the plane does not hold: sigma_zz = elastic tr eps(u) + viscous tr eps(w) - expansion (theta - reference). All
/// zero in plane stress and in space.
struct OutOfPlane {
  double elastic = 0, viscous = 0, expansion = 0;
};

template <int d>
struct Material {
  double density = 0;                      ///< rho; 0 leaves the motion quasistatic
  std::optional<Tensor4<d>> elasticity;    ///< F of (2.1), Mandel form
  std::optional<Tensor4<d>> viscosity;     ///< A of (2.1), Mandel form
  std::optional<Tensor2<d>> conductivity;  ///< K of (2.2); absent: no heat
  std::optional<Tensor2<d>> expansion;     ///< M of (2.1)
  std::optional<Tensor2<d>> heating;       ///< R of (2.4)
  double capacity = 1;                     ///< of heat, per volume and temperature
  double reference = 0;                    ///< temperature at which expansion adds no stress
  OutOfPlane out_of_plane{};
};

/// Quadrature of the contact law on a part: `points` = 0 is the vertex rule (nodal), n > 0 Gauss's with n points an
/// edge.
struct ContactQuadrature {
  int points = 0;
};

/// One part of Gamma_C; without a law it only exchanges heat.
struct ContactPart {
  std::string part;
  std::optional<ContactLaw> law;
  ContactQuadrature quadrature;
  double conductance = 0;  ///< k_c of (2.10)
  ContactHeat heat{};
};

template <int d>
struct Problem {
  std::shared_ptr<const Mesh<d>> mesh;
  std::vector<Material<d>> materials;
  std::vector<int> regions;                          ///< material of every cell; empty: the first one everywhere
  std::vector<std::string> prescribed_displacement;  ///< parts with given displacement (2.5)
  std::vector<std::string> prescribed_temperature;   ///< parts with given temperature (2.7)
  std::vector<ContactPart> contacts;
  std::vector<HeldNode<d>> held_nodes{};  ///< with a displacement that is given in some directions
  std::vector<PartSprings<d>> springs{};  ///< springs and dashpots on parts
  bool lumped = false;  ///< capacity and exchange by the vertex rule, diagonal: no new extremes on non-obtuse meshes

  const Material<d>& material(Index cell) const {
    return materials[regions.empty() ? 0 : static_cast<std::size_t>(regions[static_cast<std::size_t>(cell)])];
  }
  /// Whether any material has the block, e.g. `has(&Material<d>::viscosity)`.
  template <class Block>
  bool has(std::optional<Block> Material<d>::*block) const {
    for (const auto& m : materials)
      if (m.*block) return true;
    return false;
  }
  bool inertial() const {
    for (const auto& m : materials)
      if (m.density > 0) return true;
    return false;
  }
  /// Whether there is a velocity, and a temperature, to solve for.
  bool moves() const { return inertial() || has(&Material<d>::elasticity) || has(&Material<d>::viscosity); }
  bool conducts() const { return has(&Material<d>::conductivity); }
  bool conducts_symmetrically() const {
    for (const auto& m : materials)
      if (m.conductivity && !m.conductivity->isApprox(m.conductivity->transpose())) return false;
    return true;
  }
  /// Whether some contact part conducts or makes heat by its forces.
  bool contact_heats() const {
    for (const auto& c : contacts)
      if (c.heat.present()) return true;
    return false;
  }
};

/// Cauchy stress (2.1) of every cell at its centroid, (cells, d*d) row-major, from nodal u, w (nodes, d) and theta
/// (nodes); a field the problem does not have may be empty.
template <int d>
RealTable<d * d> stress(const Problem<d>& problem, const RealTable<d>& u, const RealTable<d>& w,
                        const Eigen::VectorXd& theta);

/// Largest principal strain, in size, of all cells for nodal u (nodes, d); dimensionless.
template <int d>
double largest_strain(const Mesh<d>& mesh, const RealTable<d>& u);

/// sigma_zz of every cell at its centroid, (cells), see OutOfPlane; zero for d = 3, whose stress holds it.
template <int d>
Eigen::VectorXd stress_out_of_plane(const Problem<d>& problem, const RealTable<d>& u, const RealTable<d>& w,
                                    const Eigen::VectorXd& theta);

}  // namespace warmslip
