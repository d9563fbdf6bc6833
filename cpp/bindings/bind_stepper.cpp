#include "bindings.hpp"
#include "warmslip/time/stepper.hpp"

namespace warmslip::bindings {
namespace {

constexpr std::array extent_parts{&Extent::size, &Extent::scale, &Extent::change};

template <int d>
void bind(py::module_& m) {
  using R = StepReport<d>;
  py::class_<R>(m, name<d>("StepReport").c_str(), "What one step did.")
      .def_readonly("outcome", &R::outcome)
      .def_readonly("reason", &R::reason, "of a step that was rejected, in words")
      .def_readonly("stage", &R::stage)
      .def_readonly("newton_iterations", &R::newton_iterations)
      .def_readonly("open", &R::open)
      .def_readonly("stick", &R::stick)
      .def_readonly("slip", &R::slip)
      .def_readonly("max_penetration", &R::max_penetration, "length")
      .def_readonly("normal_force", &R::normal_force, "int p_nu, force")
      .def_readonly("traction", &R::traction, "int sigma nu over Gamma_C, (d)")
      .def_readonly("friction_traction", &R::friction_traction, "its tangential part, (d)")
      .def_readonly("balances", &R::balances)
      .def_readonly("errors", &R::errors, "estimated, of the fields")
      .def_readonly("undetermined", &R::undetermined, "a change of the loads has no definite answer");

  using Maybe = std::optional<Vec>;
  using S = Stepper<d>;
  py::class_<S, std::shared_ptr<S>>(m, name<d>("Stepper").c_str(), "Backward Euler (collective).")
      .def(py::init([](const Layout<d>& layout, const Problem<d>& problem, const Operators<d>& operators,
                       const ContactSurface<d>& surface, double k, Coupling coupling, Backend backend,
                       const ContactOptions& contact) {
             return std::make_shared<S>(layout, problem, operators, surface,
                                        StepperOptions{k, coupling, backend, contact});
           }),
           py::arg("layout"), py::arg("problem"), py::arg("operators"), py::arg("surface"), py::kw_only(), py::arg("k"),
           py::arg("coupling"), py::arg("backend"), py::arg("contact"), py::keep_alive<1, 2>(), py::keep_alive<1, 3>(),
           py::keep_alive<1, 4>(), py::keep_alive<1, 5>())
      .def(py::init([](const Problem<d>& problem, const S& like) { return std::make_shared<S>(problem, like); }),
           py::arg("problem"), py::kw_only(), py::arg("like"), py::keep_alive<1, 2>(), py::keep_alive<1, 3>(),
           "For a problem that differs in loads, contact laws and initial data alone; shares the factors of `like`.")
      .def("set_step", &S::set_step, py::arg("k"),
           "The size of the next steps, time; factors that are kept are used again (collective).")
      .def_property_readonly("step", &S::step, "Size of the next steps, time.")
      .def("has_factored", &S::has_factored, py::arg("k"), "Whether factors for a step size are kept.")
      .def_property_readonly("refactoring_price", &S::refactoring_price,
                             "About how many steps the factorization for another step size costs.")
      .def("revert", &S::revert, "Takes the last step back, once for each step.")
      .def(
          "start",
          [](S& s, const Maybe& u, const Maybe& w, const Maybe& theta, const Eigen::VectorXd& gap, double time) {
            s.start(u.value_or(nullptr), w.value_or(nullptr), theta.value_or(nullptr), gap, time);
          },
          py::arg("u"), py::arg("w"), py::arg("theta"), py::arg("gap"), py::arg("time"),
          "Sets the state; None for a field the problem does not have.")
      .def(
          "resume",
          [](S& s, const Eigen::VectorXd& force, const std::vector<int>& status, const std::array<double, 18>& given,
             int taken) {
            std::vector<Status> statuses;
            for (const int one : status) statuses.push_back(static_cast<Status>(one));
            FieldExtents extents;
            auto value = given.begin();
            for (Extent* field : extents.all())
              for (double Extent::*part : extent_parts) field->*part = *value++;
            extents.force = *value++;
            extents.looked = *value++;
            extents.speed = *value++;
            for (double& along : extents.motion) along = *value++;
            s.resume(force, statuses, extents, taken);
          },
          py::arg("contact_force"), py::arg("status"), py::arg("extents"), py::arg("taken"),
          "After `start`: the contact points of the step before, the extents so far and the number of steps, for the "
          "same "
          "next step to the last bit.")
      .def_property_readonly(
          "extents",
          [](const S& s) {
            FieldExtents extents = s.extents();
            std::array<double, 18> out{};
            auto value = out.begin();
            for (const Extent* field : extents.all())
              for (double Extent::*part : extent_parts) *value++ = field->*part;
            *value++ = extents.force;
            *value++ = extents.looked;
            *value++ = extents.speed;
            for (const double along : extents.motion) *value++ = along;
            return out;
          },
          "Of displacement, temperature, stress and contact force so far: the largest value, that or what rounding may "
          "make of it, and the largest estimated change; then the largest nodal force, the displacement at the last "
          "look at the stress, the largest velocity, and the largest displacements, by axis.")
      .def("part", &S::part, py::arg("strained"), py::arg("strained_w"), py::arg("rigid"),
           "After `start`: displacement and velocity of a body without supports but for rigid motions, and the "
           "velocities of those.")
      .def("clear_cache", &S::clear_cache, "Drops what is remembered of earlier steps beside the state.")
      .def(
          "advance",
          [](S& s, const Maybe& force, const Maybe& heat, const Eigen::VectorXd& gap, const Maybe& velocity,
             const Maybe& temperature, const Eigen::VectorXd& foundation, const Eigen::VectorXd& foundation_velocity,
             bool measured, double time) {
            return s.advance({force.value_or(nullptr), heat.value_or(nullptr), gap, velocity.value_or(nullptr),
                              temperature.value_or(nullptr), foundation, foundation_velocity, measured, time});
          },
          py::arg("force"), py::arg("heat"), py::arg("gap"), py::arg("support_velocity") = py::none(),
          py::arg("support_temperature") = py::none(), py::arg("foundation") = Eigen::VectorXd(),
          py::arg("foundation_velocity") = Eigen::VectorXd(), py::arg("measured") = false,
          py::arg("time") = std::numeric_limits<double>::quiet_NaN(),
          "One step; the state stays when the outcome is not completed. See StepLoads.")
      .def_property_readonly(
          "u", [](const S& s) { return share(s.level().u); },
          "Displacement. The vectors change owner at every step: ask again.")
      .def_property_readonly(
          "w", [](const S& s) { return share(s.level().w); }, "Velocity.")
      .def_property_readonly(
          "theta", [](const S& s) { return share(s.level().theta); }, "Temperature.")
      .def_property_readonly(
          "strained", [](const S& s) { return share(s.level().strained); },
          "Displacement but for a rigid motion, with the digits that this would take; None where the body has a "
          "support.")
      .def_property_readonly(
          "strained_w", [](const S& s) { return share(s.level().strained_w); }, "Velocity likewise.")
      .def_property_readonly(
          "rigid", [](const S& s) { return s.level().rigid; },
          "Velocities of the rigid motions of a body without supports, along motions that the mesh gives.")
      .def_property_readonly("time", &S::time)
      .def_property_readonly(
          "reactions", [](const S& s) { return share(s.reactions()); },
          "Forces of the supports on the body at the nodes in the step that was evaluated last, force.")
      .def_property_readonly(
          "support_heat", [](const S& s) { return share(s.support_heat()); },
          "Heat per time from the supports of the temperature into the body at the nodes in that step; None without "
          "heat.")
      .def_property_readonly(
          "contact_heat_flow", [](const S& s) { return s.contact_heat_flow(); },
          "Heat per time at the contact points in that step, (points, 2): what pressure conducts into the foundation, "
          "and what friction gives to the body. Empty where the contact does neither.")
      .def_property_readonly(
          "contact_force", [](const S& s) { return s.contact_force(); }, "(d points), of the body on the foundation")
      .def_property_readonly(
          "contact_displacement", [](const S& s) { return s.level().contact_u; }, "(d points)")
      .def_property_readonly(
          "status",
          [](const S& s) {
            std::vector<int> status;
            for (const Status one : s.status()) status.push_back(static_cast<int>(one));
            return status;
          },
          "0 open, 1 stick, 2 slip, a point")
      .def_property_readonly(
          "contact_compliance",
          [](const S& s) { return s.contact_solver() ? s.contact_solver()->compliance() : Eigen::MatrixXd(); },
          "(d points, d points), velocity per force; rigid motions apart where the body has no support")
      .def_property_readonly(
          "contact_motions",
          [](const S& s) { return s.contact_solver() ? s.contact_solver()->coupling().motions : Eigen::MatrixXd(); },
          "(d points, motions), velocities of the points in the rigid motions apart")
      .def_property_readonly(
          "contact_inertia",
          [](const S& s) { return s.contact_solver() ? s.contact_solver()->coupling().inertia : Eigen::MatrixXd(); },
          "(motions, motions), force per velocity; 0 in a step without inertia")
      .def_property_readonly(
          "contact_free", [](const S& s) { return s.posed().free; },
          "(d points), velocity without contact force in the step tried last, rigid motions apart")
      .def_property_readonly(
          "contact_rigid",
          [](const S& s) -> Eigen::VectorXd {  // what is posed leaves out what the known force balances
            const auto& posed = s.posed();
            if (posed.known_force.size() == 0 || posed.rigid.size() == 0) return posed.rigid;
            return posed.rigid + s.contact_solver()->coupling().motions.transpose() * posed.known_force;
          },
          "(motions), load on the rigid motions in the step tried last")
      .def_property_readonly(
          "contact_penetration",
          [](const S& s) {
            Eigen::VectorXd out(static_cast<Eigen::Index>(s.posed().points.size()));
            for (Eigen::Index i = 0; i < out.size(); ++i)
              out[i] = s.posed().points[static_cast<std::size_t>(i)].penetration;
            return out;
          },
          "(points), length, at the start of the step tried last with the gap of its end")
      .def_property_readonly("cost", &S::cost)
      .def_property_readonly(
          "momentum_factor", [](S& s) { return s.momentum_factor(); }, py::return_value_policy::reference_internal)
      .def_property_readonly(
          "heat_factor", [](S& s) { return s.heat_factor(); }, py::return_value_policy::reference_internal)
      .def_property_readonly("solver", &S::solver, "The factorizations in words.");
}

}  // namespace

void bind_stepper(py::module_& m) {
  py::enum_<Coupling>(m, "Coupling")
      .value("staggered", Coupling::staggered)
      .value("lagged", Coupling::lagged)
      .value("monolithic", Coupling::monolithic);
  py::enum_<Outcome>(m, "Outcome")
      .value("completed", Outcome::completed)
      .value("contact_not_converged", Outcome::contact_not_converged)
      .value("not_finite", Outcome::not_finite)
      .value("balance_violated", Outcome::balance_violated)
      .value("precision_lost", Outcome::precision_lost)
      .value("unsupported", Outcome::unsupported)
      .value("solver_failed", Outcome::solver_failed);
  py::enum_<Stage>(m, "Stage")
      .value("none", Stage::none)
      .value("newton", Stage::newton)
      .value("restart", Stage::restart)
      .value("tresca_fixed_point", Stage::tresca_fixed_point)
      .value("enumeration", Stage::enumeration);
  py::class_<ContactOptions>(m, "ContactOptions")
      .def(py::init<>())
      .def_readwrite("tolerance", &ContactOptions::tolerance)
      .def_readwrite("newton_steps", &ContactOptions::newton_steps)
      .def_readwrite("fixed_point_steps", &ContactOptions::fixed_point_steps)
      .def_readwrite("enumerate_points", &ContactOptions::enumerate_points);

  auto balances = py::class_<Balances>(m, "Balances", "Terms and relative residuals of the balances of one step.");
  py::list terms;
  const auto term = [&](const char* attribute, double Balances::*member) {
    balances.def_readonly(attribute, member);
    terms.append(attribute);
  };
  term("kinetic", &Balances::kinetic);
  term("elastic", &Balances::elastic);
  term("contact", &Balances::contact);
  term("kinetic_change", &Balances::kinetic_change);
  term("elastic_change", &Balances::elastic_change);
  term("contact_change", &Balances::contact_change);
  term("inertia_damping", &Balances::inertia_damping);
  term("elastic_damping", &Balances::elastic_damping);
  term("contact_damping", &Balances::contact_damping);
  term("viscous", &Balances::viscous);
  term("friction", &Balances::friction);
  term("load_work", &Balances::load_work);
  term("expansion_work", &Balances::expansion_work);
  term("gap_work", &Balances::gap_work);
  term("support_work", &Balances::support_work);
  term("foundation_work", &Balances::foundation_work);
  term("heat_change", &Balances::heat_change);
  term("heat_damping", &Balances::heat_damping);
  term("conducted", &Balances::conducted);
  term("exchanged", &Balances::exchanged);
  term("supplied", &Balances::supplied);
  term("heating", &Balances::heating);
  term("friction_heating", &Balances::friction_heating);
  term("support_heat", &Balances::support_heat);
  term("energy_residual", &Balances::energy_residual);
  term("heat_residual", &Balances::heat_residual);
  term("force_residual", &Balances::force_residual);
  term("law_residual", &Balances::law_residual);
  term("force_defect", &Balances::force_defect);
  term("heat_defect", &Balances::heat_defect);
  term("force_scale", &Balances::force_scale);
  balances.attr("terms") = py::tuple(terms);

  auto errors = py::class_<Errors>(
      m, "Errors", "Estimated relative errors of the fields of one step; nan is absent or not measured.");
  py::list fields;
  const auto field = [&](const char* attribute, double Errors::*member) {
    errors.def_readonly(attribute, member);
    fields.append(attribute);
  };
  field("u", &Errors::u);
  field("theta", &Errors::theta);
  field("stress", &Errors::stress);
  field("contact_force", &Errors::contact_force);
  errors.attr("fields") = py::tuple(fields);
  errors.def_property_readonly("measured", &Errors::measured, "Whether the error of any field was estimated.");

  auto cost = py::class_<Cost>(m, "Cost",
                               "What a run cost so far: CPU seconds of this process for the set-up and the steps, "
                               "elapsed seconds for the parts of a step, counts, bytes of the factors.");
  py::list items;
  const auto item = [&](const char* attribute, auto member) {
    cost.def_readonly(attribute, member);
    items.append(attribute);
  };
  item("setup_seconds", &Cost::setup_seconds);
  item("step_seconds", &Cost::step_seconds);
  item("momentum_seconds", &Cost::momentum_seconds);
  item("contact_seconds", &Cost::contact_seconds);
  item("heat_seconds", &Cost::heat_seconds);
  item("balance_seconds", &Cost::balance_seconds);
  item("steps", &Cost::steps);
  item("refinements", &Cost::refinements);
  item("estimates", &Cost::estimates);
  item("substitutions", &Cost::substitutions);
  item("factorizations", &Cost::factorizations);
  item("dense_factorizations", &Cost::dense_factorizations);
  item("newton_iterations", &Cost::newton_iterations);
  item("factor_bytes", &Cost::factor_bytes);
  cost.attr("items") = py::tuple(items);
  bind<2>(m);
  bind<3>(m);
}

}  // namespace warmslip::bindings
