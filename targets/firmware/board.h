/* What a board gives to the firmware. Everything is polled: no interrupt is taken, nothing allocated. */
#ifndef WHIRL_BOARD_H
#define WHIRL_BOARD_H
#include <stdbool.h>
#include <stdint.h>

/* One sample of the machine. */
typedef struct {
  uint32_t tick;   /* of the board, one per sample time */
  float x;         /* m, displacement of the disk; NaN: no reading */
  float y;         /* m */
  double beta;     /* rad, continuous */
  float omega;     /* rad/s */
  float omega_dot; /* rad/s^2 */
  bool done;       /* the experiment is over (emulation only) */
} board_sample;

void board_init(void);
/* True once per sample time, with the newest sample. Without one it may sleep until a byte or a sample comes. */
bool board_read(board_sample *out);
/* Volts of both actuators; zero is safe. `start` asks the machine to begin (emulation only). */
void board_write(uint32_t tick, float x_volts, float y_volts, bool armed, bool start);
/* One byte from the host, or -1. */
int board_get(void);
void board_put(uint8_t byte);

#endif
