/* The board of QEMU's machine mps2-an386: sensors and actuators are at the other end of the first serial line, as messages of
   whirl's board protocol (a served virtual rig); the host is on the second. */
#include "board.h"

#include <math.h>

#include "config.h"
#include "wire.h"

/* CMSDK UART: data, state (1 transmitter full, 2 receiver full), control (1 transmit, 2 receive, 8 interrupt of the receiver),
   its interrupts (2 receiver; written: cleared), clock divider. */
static volatile uint32_t *const machine = (volatile uint32_t *)0x40004000u;
static volatile uint32_t *const host = (volatile uint32_t *)0x40005000u;

/* Receivers of both lines among the interrupts: 0 and 2. They are masked and only end the sleep of an idle board. */
enum { RECEIVERS = 5 };
static volatile uint32_t *const interrupts_on = (volatile uint32_t *)0xE000E100u;
static volatile uint32_t *const interrupts_gone = (volatile uint32_t *)0xE000E280u;

static wire_input input;
static uint32_t number;

static int get(volatile uint32_t *uart) { return ((uart[1] & 2u) != 0u) ? (int)(uart[0] & 0xFFu) : -1; }
static void put(volatile uint32_t *uart, uint8_t byte) {
  while ((uart[1] & 1u) != 0u) {
  }
  uart[0] = byte;
}
static void put_machine(uint8_t byte) { put(machine, byte); }

void board_init(void) {
  __asm__ volatile("cpsid i");
  machine[4] = 16u;
  machine[2] = 11u;
  host[4] = 16u;
  host[2] = 11u;
  *interrupts_on = RECEIVERS;
}

int board_get(void) { return get(host); }
void board_put(uint8_t byte) { put(host, byte); }

/* 4 to 20 mA over a shunt, as the lasers' analogue outputs; NaN outside. */
static float displacement(double volts) {
  const double current = volts / SHUNT_OHM;
  return ((current > 3.9e-3) && (current < 20.1e-3)) ? (float)((((current - 4e-3) / 16e-3) - 0.5) * RANGE_M) : NAN;
}

/* Sleeps until a byte comes. One that comes between the look and the sleep ends the sleep at once. */
static void wait_for_byte(void) {
  machine[3] = 2u;
  host[3] = 2u;
  *interrupts_gone = RECEIVERS;
  if (((machine[1] | host[1]) & 2u) == 0u) {
    __asm__ volatile("wfi" ::: "memory");
  }
}

bool board_read(board_sample *out) {
  int byte;
  while ((byte = get(machine)) >= 0) {
    if (wire_take(&input, (uint8_t)byte) == WIRE_READING) {
      const uint8_t *const m = input.bytes;
      out->tick = wire_get32(&m[4]);
      out->done = (wire_get32(&m[8]) & 4u) != 0u;
      out->beta = wire_get_double(&m[16]);
      out->omega = (float)wire_get_double(&m[24]);
      out->omega_dot = (float)wire_get_double(&m[32]);
      out->x = displacement(wire_get_double(&m[40]));
      out->y = displacement(wire_get_double(&m[48]));
      return true;
    }
  }
  wait_for_byte();
  return false;
}

void board_write(uint32_t tick, float x_volts, float y_volts, bool armed, bool start) {
  uint8_t m[WIRE_COMMAND] = {'W', 'H', 'C', '1'};
  wire_put32(&m[4], ++number);
  wire_put32(&m[8], tick);
  wire_put32(&m[12], (armed ? 1u : 0u) | (start ? 2u : 0u));
  wire_put_double(&m[16], (double)x_volts);
  wire_put_double(&m[24], (double)y_volts);
  wire_send(put_machine, m, WIRE_COMMAND);
}
