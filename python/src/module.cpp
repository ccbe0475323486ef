#include <filesystem>

#include "bindings.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::python {

void stop_when_interrupted() {
  const py::gil_scoped_acquire lock;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

py::object as_python(const io::Json& document) { return py::module_::import("json").attr("loads")(document.dump()); }

PYBIND11_MODULE(_whirl, m) {
  m.doc() = "C++ core of the Python package whirl";
  py::register_exception<Error>(m, "Error", PyExc_ValueError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const std::filesystem::filesystem_error& e) {
      PyErr_SetString(py::module_::import("whirl._whirl").attr("Error").ptr(),
                      (e.path1().string() + ": cannot be written: " + e.code().message()).c_str());
    }
  });
  m.attr("__version__") = std::string(version());
  bind_values(m);
  bind_identification(m);
  bind_modal(m);
  bind_control(m);
  bind_steady(m);
  bind_sparse(m);
  bind_plants(m);
  bind_studies(m);
  bind_findings(m);
  bind_shaft(m);
}

}  // namespace whirl::python
