#pragma once
#include <dlfcn.h>
#include <fmt/format.h>

#include <string>

#include "whirl/core/error.hpp"

namespace whirl::rt {

/// A shared library, loaded while this object lives.
class SharedLibrary {
 public:
  explicit SharedLibrary(const std::string& name)
      : name_(name), handle_(::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (!handle_) throw Error(fmt::format("board library {}: {}", name, ::dlerror()));
  }
  ~SharedLibrary() { ::dlclose(handle_); }
  SharedLibrary(const SharedLibrary&) = delete;
  SharedLibrary& operator=(const SharedLibrary&) = delete;

  template <class Function>
  void find(const char* symbol, Function*& to) const {
    to = reinterpret_cast<Function*>(::dlsym(handle_, symbol));
    if (!to) throw Error(fmt::format("board library {} has no function {}", name_, symbol));
  }

 private:
  std::string name_;
  void* handle_;
};

}  // namespace whirl::rt
