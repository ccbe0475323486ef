#pragma once
#include <zip.h>

#include <fstream>
#include <map>
#include <memory>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "whirl/deploy/fmu.hpp"
#include "whirl/testing/compiled.hpp"

namespace whirl::testing {

/// Unpacks a ZIP file; returns its names in order.
inline std::vector<std::string> unpack(const std::filesystem::path& archive, const std::filesystem::path& folder) {
  std::vector<std::string> names;
  zip_t* const zip = zip_open(archive.c_str(), ZIP_RDONLY, nullptr);
  if (zip == nullptr) throw std::runtime_error("not a ZIP file");
  for (zip_int64_t i = 0; i < zip_get_num_entries(zip, 0); ++i) {
    zip_stat_t info;
    zip_stat_index(zip, static_cast<zip_uint64_t>(i), 0, &info);
    names.emplace_back(info.name);
    std::string bytes(info.size, '\0');
    zip_file_t* const file = zip_fopen_index(zip, static_cast<zip_uint64_t>(i), 0);
    zip_fread(file, bytes.data(), bytes.size());
    zip_fclose(file);
    std::filesystem::create_directories((folder / info.name).parent_path());
    std::ofstream(folder / info.name, std::ios::binary) << bytes;
  }
  zip_discard(zip);
  return names;
}

/// An FMU of version 2 or 3 as an importer sees it: everything it needs is read from modelDescription.xml.
class Importer {
 public:
  Importer(const std::filesystem::path& fmu, const std::filesystem::path& folder) {
    names = unpack(fmu, folder);
    if (!xml.load_file((folder / "modelDescription.xml").c_str())) throw std::runtime_error("no modelDescription.xml");
    root = xml.child("fmiModelDescription");
    three = std::string(root.attribute("fmiVersion").value()) == "3.0";
    token = root.attribute(three ? "instantiationToken" : "guid").value();
    for (const pugi::xml_node v : root.child("ModelVariables").children()) {
      reference[v.attribute("name").value()] = v.attribute("valueReference").as_uint();
      variables.push_back(v);
    }
    const pugi::xml_node kind = root.child("CoSimulation") ? root.child("CoSimulation") : root.child("ModelExchange");
    id = kind.attribute("modelIdentifier").value();
    library =
        std::make_unique<SharedLibrary>(folder / (three ? "binaries/x86_64-linux" : "binaries/linux64") / (id + ".so"));
  }

  template <class Function>
  Function* function(const std::string& name) const {
    return library->get<Function>((three ? "fmi3" : "fmi2") + name);
  }
  void* instantiate(bool model_exchange, const std::string& with_token) const {
    if (!three) {
      return function<void*(const char*, int, const char*, const char*, const void*, int, int)>("Instantiate")(
          "it", model_exchange ? 0 : 1, with_token.c_str(), nullptr, nullptr, 0, 0);
    }
    if (model_exchange) {
      return function<void*(const char*, const char*, const char*, bool, bool, void*, void*)>(
          "InstantiateModelExchange")("it", with_token.c_str(), nullptr, false, false, nullptr, nullptr);
    }
    return function<void*(const char*, const char*, const char*, bool, bool, bool, bool, const unsigned*, std::size_t,
                          void*, void*, void*)>("InstantiateCoSimulation")(
        "it", with_token.c_str(), nullptr, false, false, false, false, nullptr, 0, nullptr, nullptr, nullptr);
  }
  void free(void* c) const { function<void(void*)>("FreeInstance")(c); }
  int call(const char* name, void* c) const { return function<int(void*)>(name)(c); }
  int enter_initialization(void* c, double start) const {
    if (three)
      return function<int(void*, bool, double, double, bool, double)>("EnterInitializationMode")(c, false, 0, start,
                                                                                                 false, 0);
    const int setup = function<int(void*, int, double, double, int, double)>("SetupExperiment")(c, 0, 0, start, 0, 0);
    return setup != 0 ? setup : call("EnterInitializationMode", c);
  }
  /// An instance for model exchange in its first continuous-time mode.
  void* exchanging() const {
    void* const c = instantiate(true, token);
    if (c == nullptr || enter_initialization(c, 0) != 0 || call("ExitInitializationMode", c) != 0 ||
        new_discrete_states(c) != 0 || call("EnterContinuousTimeMode", c) != 0)
      throw std::runtime_error("the FMU refuses continuous time");
    return c;
  }
  int set(void* c, const std::string& name, double value) const {
    const unsigned r = reference.at(name);
    return three ? function<int(void*, const unsigned*, std::size_t, const double*, std::size_t)>("SetFloat64")(
                       c, &r, 1, &value, 1)
                 : function<int(void*, const unsigned*, std::size_t, const double*)>("SetReal")(c, &r, 1, &value);
  }
  /// Several at once, by their numbers.
  int set(void* c, const std::vector<unsigned>& numbers, const std::vector<double>& values) const {
    const std::size_t n = numbers.size();
    return three ? function<int(void*, const unsigned*, std::size_t, const double*, std::size_t)>("SetFloat64")(
                       c, numbers.data(), n, values.data(), n)
                 : function<int(void*, const unsigned*, std::size_t, const double*)>("SetReal")(c, numbers.data(), n,
                                                                                                values.data());
  }
  double get(void* c, const std::string& name) const {
    const unsigned r = reference.at(name);
    double value = -1;
    const int status = three ? function<int(void*, const unsigned*, std::size_t, double*, std::size_t)>("GetFloat64")(
                                   c, &r, 1, &value, 1)
                             : function<int(void*, const unsigned*, std::size_t, double*)>("GetReal")(c, &r, 1, &value);
    if (status != 0) throw std::runtime_error("get " + name);
    return value;
  }
  bool get_boolean(void* c, const std::string& name) const {
    const unsigned r = reference.at(name);
    if (three) {
      bool value = false;
      function<int(void*, const unsigned*, std::size_t, bool*, std::size_t)>("GetBoolean")(c, &r, 1, &value, 1);
      return value;
    }
    int value = 0;
    function<int(void*, const unsigned*, std::size_t, int*)>("GetBoolean")(c, &r, 1, &value);
    return value != 0;
  }
  int set_boolean(void* c, const std::string& name, bool value) const {
    const unsigned r = reference.at(name);
    const int as_int = value;
    return three ? function<int(void*, const unsigned*, std::size_t, const bool*, std::size_t)>("SetBoolean")(c, &r, 1,
                                                                                                              &value, 1)
                 : function<int(void*, const unsigned*, std::size_t, const int*)>("SetBoolean")(c, &r, 1, &as_int);
  }
  int step(void* c, double t, double h) const {
    if (!three) return function<int(void*, double, double, int)>("DoStep")(c, t, h, 1);
    bool event, terminate, early;
    double last;
    return function<int(void*, double, double, bool, bool*, bool*, bool*, double*)>("DoStep")(
        c, t, h, true, &event, &terminate, &early, &last);
  }
  /// Change of `unknown` along `known` with the given seeds; empty when the FMU refuses.
  std::vector<double> directional(void* c, const std::vector<std::string>& unknown,
                                  const std::vector<std::string>& known, const std::vector<double>& seed) const {
    std::vector<unsigned> u, k;
    for (const std::string& name : unknown) u.push_back(reference.at(name));
    for (const std::string& name : known) k.push_back(reference.at(name));
    std::vector<double> out(u.size());
    using Two = int(void*, const unsigned*, std::size_t, const unsigned*, std::size_t, const double*, double*);
    using Three = int(void*, const unsigned*, std::size_t, const unsigned*, std::size_t, const double*, std::size_t,
                      double*, std::size_t);
    const int status =
        three ? function<Three>("GetDirectionalDerivative")(c, u.data(), u.size(), k.data(), k.size(), seed.data(),
                                                            seed.size(), out.data(), out.size())
              : function<Two>("GetDirectionalDerivative")(c, u.data(), u.size(), k.data(), k.size(), seed.data(),
                                                          out.data());
    return status == 0 ? out : std::vector<double>{};
  }
  // Model exchange
  int new_discrete_states(void* c) const {
    if (three) {
      bool a, b, d, e, f;
      double g;
      return function<int(void*, bool*, bool*, bool*, bool*, bool*, double*)>("UpdateDiscreteStates")(c, &a, &b, &d, &e,
                                                                                                      &f, &g);
    }
    struct {
      int a, b, c, d, e;
      double f;
    } info;
    return function<int(void*, void*)>("NewDiscreteStates")(c, &info);
  }
  void set_time(void* c, double t) const { function<int(void*, double)>("SetTime")(c, t); }
  void set_states(void* c, const std::vector<double>& x) const {
    function<int(void*, const double*, std::size_t)>("SetContinuousStates")(c, x.data(), x.size());
  }
  std::vector<double> vector(void* c, const char* name, std::size_t n) const {
    std::vector<double> out(n);
    if (function<int(void*, double*, std::size_t)>(name)(c, out.data(), n) != 0) throw std::runtime_error(name);
    return out;
  }
  std::vector<double> rates(void* c, std::size_t n) const {
    return vector(c, three ? "GetContinuousStateDerivatives" : "GetDerivatives", n);
  }

  pugi::xml_document xml;
  pugi::xml_node root;
  bool three = false;
  std::string token, id;
  std::vector<std::string> names;
  std::map<std::string, unsigned> reference;
  std::vector<pugi::xml_node> variables;
  std::unique_ptr<SharedLibrary> library;
};

/// The sources of an FMU built, packed as unit.fmu, unpacked and loaded.
inline Importer packed(const TemporaryFolder& folder, const std::vector<deploy::SourceFile>& files,
                       const deploy::FmuOptions& options) {
  deploy::pack_fmu(files, options, folder.path() / "unit.fmu");
  return {folder.path() / "unit.fmu", folder.path() / "unpacked"};
}

}  // namespace whirl::testing
