#include "recording/layout.hpp"

namespace whirl::rt::recording {
namespace {

#define WHIRL_FIELD(name, unit) \
  Field { #name, offsetof(LoopSample, name), sizeof(LoopSample::name) == 8, unit }
constexpr Field kFields[] = {WHIRL_FIELD(t, "s"),
                             WHIRL_FIELD(scheduled, "s"),
                             WHIRL_FIELD(started, "s"),
                             WHIRL_FIELD(x, "m"),
                             WHIRL_FIELD(y, "m"),
                             WHIRL_FIELD(beta, "rad"),
                             WHIRL_FIELD(omega, "rad/s"),
                             WHIRL_FIELD(omega_dot, "rad/s^2"),
                             WHIRL_FIELD(x_est, "m"),
                             WHIRL_FIELD(y_est, "m"),
                             WHIRL_FIELD(vx_est, "m/s"),
                             WHIRL_FIELD(vy_est, "m/s"),
                             WHIRL_FIELD(dx_est, "m/s^2"),
                             WHIRL_FIELD(dy_est, "m/s^2"),
                             WHIRL_FIELD(s_x, "m/s"),
                             WHIRL_FIELD(s_y, "m/s"),
                             WHIRL_FIELD(ux_requested, "N"),
                             WHIRL_FIELD(uy_requested, "N"),
                             WHIRL_FIELD(ux, "N"),
                             WHIRL_FIELD(uy, "N"),
                             WHIRL_FIELD(flags, ""),
                             WHIRL_FIELD(trip, ""),
                             WHIRL_FIELD(missed, "")};
#undef WHIRL_FIELD

}  // namespace

std::span<const Field> fields() { return kFields; }

Handle cycle_type() {
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(LoopSample)), H5Tclose);
  H5Tinsert(type.get(), "tick", offsetof(LoopSample, tick), H5T_NATIVE_INT64);
  for (const Field& f : kFields) H5Tinsert(type.get(), f.name, f.offset, f.real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32);
  return type;
}

Handle event_type() {
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(EventRow)), H5Tclose);
  const Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(text.get(), sizeof(EventRow::text));
  H5Tinsert(type.get(), "tick", offsetof(EventRow, tick), H5T_NATIVE_INT64);
  H5Tinsert(type.get(), "t", offsetof(EventRow, t), H5T_NATIVE_DOUBLE);
  H5Tinsert(type.get(), "text", offsetof(EventRow, text), text.get());
  return type;
}

std::string read_text(hid_t at, const char* name) {
  const Handle attribute(H5Aopen(at, name, H5P_DEFAULT), H5Aclose);
  if (!attribute) return {};
  const Handle type(H5Aget_type(attribute.get()), H5Tclose);
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) > 0) return {};
  std::string value(H5Tget_size(type.get()), '\0');
  H5Aread(attribute.get(), type.get(), value.data());
  return value;
}

void prepare_library() {
  // A file that could not be finished stays open for ever; the library must not try again when the program ends.
  [[maybe_unused]] static const herr_t once = H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are ours to tell
}

}  // namespace whirl::rt::recording
