#include <fmt/format.h>

#include <cmath>

#include "bindings.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/expr/tape.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/regression/regression.hpp"
#include "whirl/regression/unscaled.hpp"
#include "whirl/signal/derivative.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::python {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Terms compiled once: rows of variables in, rows of terms out. NumPy arrays in C order pass without a copy.
struct Terms {
  expr::Tape tape;

  Terms(const std::vector<std::string>& terms, const std::vector<std::string>& variables)
      : tape(expr::compile(expr::parse_library(terms), variables)) {}

  RowMatrix operator()(const Eigen::Ref<const RowMatrix>& x) const {
    if (x.cols() != static_cast<Eigen::Index>(tape.n_variables())) {
      throw Error(fmt::format("{} columns: the terms take {} variables", x.cols(), tape.n_variables()));
    }
    RowMatrix out(x.rows(), static_cast<Eigen::Index>(tape.n_outputs()));
    for (Eigen::Index i = 0; i < x.rows(); ++i) tape.evaluate_point(x.row(i).data(), out.row(i).data());
    return out;
  }
};

/// An identified model, compiled once for predictions and free runs.
struct Compiled {
  identification::CompiledModel model;

  explicit Compiled(const IdentifiedModel& identified) : model(identified) {}

  RowMatrix predict(const Eigen::Ref<const RowMatrix>& x, const std::optional<Eigen::Ref<const RowMatrix>>& u) const {
    const auto n = static_cast<Eigen::Index>(model.states().size()),
               m = static_cast<Eigen::Index>(model.inputs().size());
    if (x.cols() != n) throw Error(fmt::format("x has {} columns: the model has {} states", x.cols(), n));
    if ((u ? u->cols() : 0) != m) {
      throw Error(fmt::format("u has {} columns: the model has {} inputs", u ? u->cols() : 0, m));
    }
    if (u && u->rows() != x.rows()) throw Error(fmt::format("u has {} rows, x {}", u->rows(), x.rows()));
    RowMatrix out(x.rows(), n);
    Eigen::VectorXd in(n + m);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      in.head(n) = x.row(i);
      if (u) in.tail(m) = u->row(i);
      model.rate(in.data(), out.row(i).data());
    }
    return out;
  }

  /// `u`: samples x inputs; between samples it runs straight.
  Eigen::MatrixXd simulate(const Eigen::VectorXd& start, double dt, Eigen::Index samples,
                           const std::optional<RowMatrix>& u) const {
    const auto m = static_cast<Eigen::Index>(model.inputs().size());
    if ((u ? u->cols() : 0) != m) {
      throw Error(fmt::format("u has {} columns: the model has {} inputs", u ? u->cols() : 0, m));
    }
    if (u && u->rows() < samples) throw Error(fmt::format("u has {} rows for {} times", u->rows(), samples));
    Eigen::MatrixXd half(2 * samples - 1, m);
    for (Eigen::Index i = 0; u && i < samples; ++i) {
      half.row(2 * i) = u->row(i);
      if (i + 1 < samples) half.row(2 * i + 1) = 0.5 * (u->row(i) + u->row(i + 1));
    }
    return identification::simulate(model, half, start, dt, samples).values;
  }
};

void require_step(double dt) {
  if (!(dt > 0) || !std::isfinite(dt)) throw Error::in_field("dt", fmt::format("{:g} s", dt), "above 0");
}

void require_finite(const Eigen::Ref<const Eigen::VectorXd>& x) {
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i])) throw Error(fmt::format("x, sample {}: {} is not a finite number", i, x[i]));
}

regression::SolveOptions solve_options(const py::kwargs& settings) {
  regression::SolveOptions o;
  for (const auto& [key, value] : settings) {
    const std::string name = key.cast<std::string>();
    if (name == "method")
      o.method = value.cast<std::string>();
    else if (name == "threshold")
      o.threshold = value.cast<double>();
    else if (name == "ridge")
      o.ridge = value.cast<double>();
    else if (name == "lambda_")
      o.lasso.lambda = value.cast<double>();
    else if (name == "max_terms")
      o.max_terms = value.cast<int>();
    else if (name == "t_value")
      o.t_value = value.cast<double>();
    else if (name == "resamples")
      o.ensemble.resamples = value.cast<int>();
    else if (name == "inclusion")
      o.ensemble.inclusion = value.cast<double>();
    else if (name == "base")
      o.ensemble.base = value.cast<std::string>();
    else if (name == "seed")
      o.ensemble.seed = value.cast<std::uint64_t>();
    else if (name == "sign")
      o.rules.sign = value.cast<std::vector<int>>();
    else
      throw Error::in_field("option", name,
                            "method, threshold, ridge, lambda_, max_terms, t_value, resamples, "
                            "inclusion, base, seed or sign");
  }
  return o;
}

regression::Penalty penalty_of(const std::string& name) {
  if (name == "l0") return regression::Penalty::l0;
  if (name == "l1") return regression::Penalty::l1;
  if (name == "l2") return regression::Penalty::l2;
  throw Error::in_field("penalty", name, "l0, l1 or l2");
}

/// (models x terms, mean square of each, whether it came to its end) of a regression with absolute thresholds.
std::tuple<RowMatrix, std::vector<double>, bool> unscaled_path(
    const Eigen::Ref<const RowMatrix>& theta, const Eigen::Ref<const Eigen::VectorXd>& y, const std::string& method,
    double threshold, double ridge, int max_iterations, bool by_residual, const std::string& penalty,
    Eigen::VectorXd weight, double nu, double tolerance, std::vector<int> keep, Eigen::VectorXd start) {
  const regression::UnscaledOptions options{
      method, threshold, ridge,           max_iterations,  by_residual, penalty_of(penalty), std::move(weight),
      nu,     tolerance, std::move(keep), std::move(start)};
  const py::gil_scoped_release unlocked;
  const regression::UnscaledPath path =
      regression::solve_unscaled(regression::make_problem(theta, y, 1).total, options);
  RowMatrix models(static_cast<Eigen::Index>(path.xi.size()), theta.cols());
  for (std::size_t k = 0; k < path.xi.size(); ++k) models.row(static_cast<Eigen::Index>(k)) = path.xi[k];
  return {std::move(models), path.mean_square, path.converged};
}

}  // namespace

void bind_sparse(py::module_& m) {
  py::class_<Terms>(m, "_Terms")
      .def(py::init<const std::vector<std::string>&, const std::vector<std::string>&>())
      .def("__call__", &Terms::operator());
  py::class_<Compiled>(m, "_Compiled")
      .def(py::init<const IdentifiedModel&>())
      .def_property_readonly("states", [](const Compiled& c) { return c.model.states(); })
      .def_property_readonly("inputs", [](const Compiled& c) { return c.model.inputs(); })
      .def("predict", &Compiled::predict, py::arg("x"), py::arg("u") = py::none())
      .def("simulate", &Compiled::simulate, py::call_guard<py::gil_scoped_release>(), py::arg("start"), py::arg("dt"),
           py::arg("samples"), py::arg("u") = py::none());
  m.def("regression_methods", &regression::regression_methods, "Names of the sparse regressions.");
  m.def(
      "sparse_regression",
      [](const Eigen::Ref<const RowMatrix>& theta, const Eigen::Ref<const Eigen::VectorXd>& y,
         const py::kwargs& settings) {
        const regression::SolveOptions options = solve_options(settings);
        const py::gil_scoped_release unlocked;
        return regression::solve(regression::make_problem(theta, y), options).xi;
      },
      "Coefficients of y = theta xi, sparse by one of regression_methods().");
  m.def("_unscaled_path", &unscaled_path, py::arg("theta"), py::arg("y"), py::arg("method"), py::kw_only(),
        py::arg("threshold") = 0.1, py::arg("ridge") = 0.05, py::arg("max_iterations") = 20,
        py::arg("by_residual") = false, py::arg("penalty") = "l0", py::arg("weight") = Eigen::VectorXd(),
        py::arg("nu") = 1.0, py::arg("tolerance") = 1e-5, py::arg("keep") = std::vector<int>(),
        py::arg("start") = Eigen::VectorXd());
  m.def(
      "smooth",
      [](const Eigen::Ref<const Eigen::VectorXd>& x, double dt) {
        require_step(dt);
        require_finite(x);
        const signal::SmoothedSignal s = signal::smoothing_spline_for_noise(x, dt, signal::noise_sd(x));
        return std::pair(s.value, s.first);
      },
      py::arg("x"), py::arg("dt"), "(value, rate) of the smoothing spline that leaves the noise of x.");
  m.def(
      "finite_difference",
      [](const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int order) {
        require_step(dt);
        require_finite(x);
        return signal::central_difference(x, dt, order);
      },
      py::arg("x"), py::arg("dt"), py::arg("order") = 4, "Central difference; order/2 samples are lost at each end.");
  m.def("_canonical", [](const std::string& term) { return expr::Expr::parse(term).str(); });
  m.def("_fit_sindy",
        [](const std::vector<Recording>& records, const std::vector<std::string>& states,
           const std::vector<std::string>& inputs, const std::vector<std::string>& library, bool discrete) {
          identification::SindyOptions options;
          options.states = states;
          options.inputs = inputs;
          options.library = library;
          options.discrete = discrete;
          options.timing.find = false;  // what predicts here takes inputs as they stand
          const py::gil_scoped_release unlocked;
          return identification::fit_sindy(records, options);
        });
}

}  // namespace whirl::python
