#pragma once
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <string>

#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"

/// The Python module `whirl._whirl`: values and verbs of the C++ library. Long calls run without the interpreter lock;
/// NumPy arrays of doubles go in and come out without a copy where the library does not have to own them.
namespace whirl::python {

namespace py = pybind11;

/// Pickling and equality of content through the versioned JSON of the value.
template <class T, class Class>
void add_json(Class& cls) {
  cls.def(
      "to_json", [](const T& value) { return to_json(value).dump(); }, "The value as its JSON file has it.");
  cls.def(py::pickle([](const T& value) { return py::make_tuple(to_json(value).dump()); },
                     [](const py::tuple& state) {
                       return io::from_json<T>(io::parse_json(state[0].cast<std::string>(), "pickle"), "pickle");
                     }));
}

/// Ends a long call when the user has pressed Ctrl-C; called from progress reports.
void stop_when_interrupted();

/// A JSON document as dictionaries, lists, texts and numbers.
py::object as_python(const io::Json& document);

void bind_values(py::module_& m);
void bind_identification(py::module_& m);
void bind_modal(py::module_& m);
void bind_control(py::module_& m);
void bind_steady(py::module_& m);
void bind_sparse(py::module_& m);
void bind_plants(py::module_& m);
void bind_studies(py::module_& m);
void bind_findings(py::module_& m);
void bind_shaft(py::module_& m);

}  // namespace whirl::python
