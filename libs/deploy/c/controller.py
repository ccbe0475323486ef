"""/*@title@*/

The C99 source beside this file, compiled with the system's C compiler on first use and called through ctypes. SI units.

    from /*@prefix@*/ import Controller
    c = Controller()                      # parameters: Controller(surface_gain=80)
    out = c.step(x, y, beta, omega, omega_dot)   # every /*@sample_time@*/ s; out.ux, out.uy in N
"""
import ctypes
import os
import subprocess
import tempfile

Real = ctypes./*@ctype@*/


def _struct(name, fields):
    return type(name, (ctypes.Structure,), {"_fields_": fields})


PARAMETERS = {
/*@parameters@*/
}
Params = _struct("Params", [(name, Real) for name in PARAMETERS])
Input = _struct("Input", [(name, Real) for name in ("x", "y", "beta", "omega", "omega_dot")] + [("valid", ctypes.c_bool)])
Output = _struct("Output", [(name, Real) for name in ("ux", "uy", "requested_ux", "requested_uy", "s_x", "s_y",
                                                      "x", "y", "vx", "vy")]
#if HAS_REIDENTIFY
                 + [("saturated", ctypes.c_bool), ("held", ctypes.c_bool), ("supervision", ctypes.c_uint32)]
                 + [(name, 3 * Real) for name in ("differs", "differs_sd", "corrected")]
                 + [("reidentified", ctypes.c_uint32)])
#elif HAS_SUPERVISION
                 + [("saturated", ctypes.c_bool), ("held", ctypes.c_bool), ("supervision", ctypes.c_uint32)])
#else
                 + [("saturated", ctypes.c_bool), ("held", ctypes.c_bool)])
#endif


def _library():
    here = os.path.dirname(os.path.abspath(__file__))
    with tempfile.TemporaryDirectory() as folder:
        built = os.path.join(folder, "/*@prefix@*/.so")
        # The size of the state is asked from the compiler: nothing here repeats its layout.
        size = os.path.join(folder, "size.c")
        with open(size, "w") as f:
            f.write('#include "/*@prefix@*/.h"\nunsigned long /*@prefix@*/_state_size(void);\n'
                    "unsigned long /*@prefix@*/_state_size(void) { return sizeof(/*@prefix@*/_state); }\n")
        subprocess.run([os.environ.get("CC", "cc"), "-std=c99", "-O2", "-fPIC", "-shared", "-I", here, "-o", built,
                        os.path.join(here, "/*@prefix@*/.c"), size, "-lm"], check=True)
        library = ctypes.CDLL(built)
    library./*@prefix@*/_state_size.restype = ctypes.c_ulong
    return library


class Controller:
    _loaded = None

    def __init__(self, **parameters):
        if Controller._loaded is None:
            Controller._loaded = _library()
        self._c = Controller._loaded
        self._state = ctypes.create_string_buffer(self._c./*@prefix@*/_state_size())
        params = Params(**{**PARAMETERS, **parameters})
        wrong = self._c./*@prefix@*/_init(self._state, ctypes.byref(params))
        if wrong:
            raise ValueError(list(PARAMETERS)[wrong - 1] + " is out of its range")

    def step(self, x, y, beta, omega, omega_dot=0.0, valid=True, missed=0):
        """One sample, after `missed` sample times without a step; raises ArithmeticError when the controller gives no command."""
        out = Output()
        status = self._c./*@prefix@*/_step_after(self._state, ctypes.byref(Input(x, y, beta, omega, omega_dot, valid)),
                                             ctypes.c_int32(missed), ctypes.byref(out))
        if status:
            reasons = {1: "not finite", 2: "stale sensor", 4: "supervision", 5: "gap"}
            raise ArithmeticError(reasons.get(status, "not ready"))
        return out

    def set(self, **parameters):
        """New parameters while running, each checked; what was learnt is kept. Raises ValueError naming the one refused."""
        names = list(PARAMETERS)
        for name, value in parameters.items():
            if name not in PARAMETERS:
                raise ValueError(name + " is no parameter")
            number = names.index(name) + 1
            wrong = self._c./*@prefix@*/_set_parameter(self._state, ctypes.c_int32(number), Real(value))
            if wrong:
                raise ValueError(names[wrong - 1] + " is out of its range")

    def reset(self):
        self._c./*@prefix@*/_reset(self._state)
