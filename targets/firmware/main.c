/* Firmware of a board that runs an exported float controller (prefix "law"): every sample time it reads angle and
   displacements, steps the controller and writes the volts of the actuators; a host arms it, watches it and tunes it over a
   serial line. Without the host for WATCHDOG_TICKS, and after a trip, the outputs are zero. */
#include <math.h>
#include <string.h>

#include "board.h"
#include "config.h"
#include "law.h"
#include "wire.h"

/* Why the outputs are zero although armed; latched until the host disarms. Bits 8 to 15 of the flags of a reading. */
enum { FINE, TRIP_DISPLACEMENT, TRIP_STALE, TRIP_NOT_FINITE, TRIP_GAP, TRIP_SUPERVISION, TRIP_PARAMETERS };
enum { ARMED = 1, START = 2, OUTPUT = 1, EXPIRED = 2, DONE = 4 };

typedef struct {
  law_state state;
  wire_input input;
  uint32_t flags;  /* of the newest command */
  uint32_t number; /* its number */
  bool heard;      /* any command yet */
  uint32_t silent; /* ticks since */
  bool expired;
  uint32_t trip;
  uint32_t last_tick;
  bool running; /* the controller has stepped since it was armed */
} firmware;

static firmware fw;

static float wrapped(double angle) {
  const double turn = 6.283185307179586;
  return (float)(angle - (turn * floor((angle / turn) + 0.5)));
}

/* A command of the host: armed and start; its volts are not used. */
static void take_command(const uint8_t *m) {
  const uint32_t number = wire_get32(&m[4]);
  if (fw.heard && ((int32_t)(number - fw.number) <= 0)) {
    return; /* late or doubled */
  }
  fw.heard = true;
  fw.number = number;
  fw.flags = wire_get32(&m[12]);
  fw.silent = 0u;
  if ((fw.flags & ARMED) == 0u) {
    fw.expired = false;
    fw.trip = FINE;
    fw.running = false;
  }
}

/* A parameter: set when it is inside its bounds, answered with what holds afterwards. NaN asks only. */
static void take_parameter(const uint8_t *m) {
  const uint32_t index = wire_get32(&m[8]);
  const double value = wire_get_double(&m[12]);
  uint8_t answer[WIRE_ANSWER] = {'W', 'H', 'A', '1'};
  double now = NAN;
  uint32_t wrong = index;
  if ((index >= 1u) && (index <= LAW_PARAMETERS)) {
    const law_real *const all = (const law_real *)&fw.state.params;
    wrong = 0u;
    if (!isnan(value)) {
      /* the period is that of the board */
      wrong = (strcmp(law_parameter_name((int32_t)index), "sample_time") == 0)
                  ? index
                  : (uint32_t)law_set_parameter(&fw.state, (int32_t)index, (law_real)value);
    }
    now = (double)all[index - 1u];
  }
  memcpy(&answer[4], &m[4], 8);
  wire_put32(&answer[12], wrong);
  wire_put_double(&answer[16], now);
  wire_send(board_put, answer, WIRE_ANSWER);
}

static void listen(void) {
  int byte;
  while ((byte = board_get()) >= 0) {
    const uint32_t size = wire_take(&fw.input, (uint8_t)byte);
    if (size == WIRE_COMMAND) {
      take_command(fw.input.bytes);
    } else if (size == WIRE_PARAMETER) {
      take_parameter(fw.input.bytes);
    } else {
      /* half a message, or one that a board does not take */
    }
  }
}

static uint32_t reason_of(law_status status) {
  switch (status) {
    case LAW_NOT_FINITE:
      return TRIP_NOT_FINITE;
    case LAW_STALE_SENSOR:
      return TRIP_STALE;
    case LAW_GAP:
      return TRIP_GAP;
    case LAW_NOT_READY:
      return TRIP_PARAMETERS;
    default:
      return TRIP_SUPERVISION;
  }
}

/* The force of this sample, N; a trip when there is none. */
static void step(const board_sample *s, float *ux, float *uy) {
  const int32_t missed = fw.running ? (int32_t)(s->tick - fw.last_tick) - 1 : 0;
  law_input in;
  law_output out;
  law_status status;
  in.x = s->x;
  in.y = s->y;
  in.beta = wrapped(s->beta);
  in.omega = s->omega;
  in.omega_dot = s->omega_dot;
  in.valid = !isnan(s->x) && !isnan(s->y);
  if (!fw.running) {
    law_reset(&fw.state);
    fw.running = true;
  }
  status = law_step_after(&fw.state, &in, missed, &out);
  if (status != LAW_OK) {
    fw.trip = reason_of(status);
  } else if (in.valid && (hypotf(in.x, in.y) > TRIP_M)) {
    fw.trip = TRIP_DISPLACEMENT;
  } else {
    *ux = out.ux;
    *uy = out.uy;
  }
}

static float limited(float volts) { return (volts > LIMIT_V) ? LIMIT_V : ((volts < -LIMIT_V) ? -LIMIT_V : volts); }

static void report(const board_sample *s, bool live) {
  uint8_t m[WIRE_READING] = {'W', 'H', 'R', '1'};
  wire_put32(&m[4], s->tick);
  wire_put32(&m[8], (live ? OUTPUT : 0u) | (fw.expired ? EXPIRED : 0u) | (s->done ? DONE : 0u) | (fw.trip << 8));
  wire_put32(&m[12], fw.number);
  wire_put_double(&m[16], s->beta);
  wire_put_double(&m[24], (double)s->omega);
  wire_put_double(&m[32], (double)s->omega_dot);
  wire_put_double(&m[40], (double)s->x);
  wire_put_double(&m[48], (double)s->y);
  wire_send(board_put, m, WIRE_READING);
}

int main(void) {
  board_sample s;
  law_params params;
  law_default_params(&params);
  if (law_init(&fw.state, &params) != 0) {
    fw.trip = TRIP_PARAMETERS;
  }
  board_init();
  for (;;) {
    listen();
    if (board_read(&s)) {
      float ux = 0.0f;
      float uy = 0.0f;
      bool live;
      listen(); /* what came in the meantime counts */
      if (fw.silent < UINT32_MAX) {
        fw.silent++;
      }
      fw.expired = fw.expired || (fw.silent >= WATCHDOG_TICKS);
      live = ((fw.flags & ARMED) != 0u) && !fw.expired && (fw.trip == FINE);
      if (live) {
        step(&s, &ux, &uy);
        live = (fw.trip == FINE);
      }
      fw.last_tick = s.tick;
      board_write(s.tick, limited(ux / FORCE_PER_VOLT), limited(uy / FORCE_PER_VOLT), live, (fw.flags & START) != 0u);
      if ((s.tick % REPORT_EVERY) == 0u) {
        report(&s, live);
      }
    }
  }
}
