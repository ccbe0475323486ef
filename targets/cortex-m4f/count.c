/* What one step of an exported controller costs: instructions (mean and worst over a run through resonance), and stack.
   Under QEMU's `-icount shift=0` an instruction takes 1 ns of its time and SysTick counts 25 MHz: 40 instructions each. */
#include <math.h>

#include "law.h"
#include "start.h"

enum { STEPS = 4000, PAINTED = 4096, PER_COUNT = 40 };
static law_params params;
static law_state state;
static volatile uint32_t *const systick = (volatile uint32_t *)0xE000E010u;

static uint32_t now(void) { return systick[2]; }

static uint8_t *stack_pointer(void) {
  uint8_t *sp;
  __asm__ volatile("mov %0, sp" : "=r"(sp));
  return sp;
}
static void paint(volatile uint8_t *below) {
  uint32_t i;
  for (i = 1u; i <= PAINTED; ++i) below[-(int32_t)i] = 0xA5u;
}
static uint32_t used(const volatile uint8_t *below) {
  uint32_t i = PAINTED;
  while (i > 0u && below[-(int32_t)i] == 0xA5u) --i;
  return i;
}
static uint32_t random_state = 1u;
static float noise(void) {
  random_state = random_state * 1664525u + 1013904223u;
  return (float)(int32_t)random_state * 4.656613e-10f;
}

int main(void) {
  uint32_t k, sum = 0u, worst = 0u, empty = 0u, stack;
  float beta = 0.0f;
  law_input in = {0};
  law_output out;
  law_default_params(&params);
#ifdef LAW_WATCH_TRIP
  params.watch_level = 1.0f; /* the motion here does not follow the force */
#endif
  if (law_init(&state, &params) != 0) return 1;
  systick[1] = 0xFFFFFFu;
  systick[0] = 5u;
  for (k = 0; k < 200u; ++k) { /* what reading the counter takes itself */
    const uint32_t before = now();
    empty += (before - now()) & 0xFFFFFFu;
  }
  paint(stack_pointer());
  for (k = 0; k < STEPS; ++k) {
    const float omega = 20.0f + 60.0f * (float)k / STEPS;
    const float detuning = (omega - 46.0f) / 4.0f, r = 0.002f / sqrtf(1.0f + detuning * detuning);
    uint32_t before, took;
    beta += omega * 1e-3f;
    if (beta > 3.14159265f) beta -= 6.28318531f;
    in.x = r * cosf(beta) + 2e-6f * noise();
    in.y = r * sinf(beta) + 2e-6f * noise();
    in.beta = beta;
    in.omega = omega;
    in.omega_dot = 15.0f;
    in.valid = k % 997u != 0u;
    before = now();
    if (law_step(&state, &in, &out) != LAW_OK) return 2;
    took = (before - now()) & 0xFFFFFFu;
    sum += took;
    if (took > worst) worst = took;
    if (out.saturated) law_applied(&state, out.ux, out.uy);
  }
  stack = used(stack_pointer());
  print_text("mean ");
  print_number((uint32_t)((uint64_t)sum * PER_COUNT / STEPS - (uint64_t)empty * PER_COUNT / 200u));
  print_text(" worst ");
  print_number(worst * PER_COUNT);
  print_text(" stack ");
  print_number(stack);
  print_text(" state ");
  print_number((uint32_t)sizeof state);
  print_text("\n");
  return 0;
}
