// A problem: a mesh, its material, its supports and its contact part. Values only.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "warmslip/contact.hpp"
#include "warmslip/mesh.hpp"

namespace warmslip {

template <int d>
struct Material {
  double density;           ///< rho
  Tensor4<d> elasticity;    ///< F of (2.1), Mandel form
  Tensor4<d> viscosity;     ///< A of (2.1), Mandel form
  Tensor2<d> conductivity;  ///< K of (2.2)
  Tensor2<d> expansion;     ///< M of (2.1)
  Tensor2<d> heating;       ///< R of (2.4)
};

/// Quadrature of the contact law on Gamma_C: `points` = 0 is the vertex rule (nodal), n > 0 Gauss's with n points an
/// edge.
struct ContactQuadrature {
  int points = 0;
};

template <int d>
struct Problem {
  std::shared_ptr<const Mesh<d>> mesh;
  Material<d> material;
  std::vector<std::string> clamped;  ///< parts with u = 0 (2.5)
  std::vector<std::string> cooled;   ///< parts with theta = 0 (2.7)
  std::string contact_part;          ///< Gamma_C
  ContactLaw law;
  ContactQuadrature quadrature;
  double conductance;  ///< k_c of (2.10)
};

/// Cauchy stress (2.1) of every cell at its centroid, (cells, d*d) row-major, from nodal u, w (nodes, d) and theta
/// (nodes).
template <int d>
RealTable<d * d> stress(const Mesh<d>& mesh, const Material<d>& material, const RealTable<d>& u, const RealTable<d>& w,
                        const Eigen::VectorXd& theta);

}  // namespace warmslip
