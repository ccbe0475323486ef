/* NUCLEO-F446RE (STM32F446RE, Cortex-M4F; addresses and bits: ST's reference manual RM0390). Wiring: docs/hardware.md.

   A0 PA0, A1 PA1  displacements x, y: 4 to 20 mA over SHUNT_OHM
   A2 PA4, D13 PA5 forces x, y: 0 to 3.3 V, the middle is no force (amplifier to -10..10 V)
   D12 PA6, D11 PA7 encoder, both edges of both tracks
   USB             host, through the ST-LINK's serial port, 115200 baud */
#include "board.h"

#include <math.h>

#include "config.h"

#ifndef COUNTS_PER_TURN
#define COUNTS_PER_TURN 4096
#endif
#define TRACKING 31.4159265f /* rad/s, bandwidth of speed and acceleration out of the encoder */
#define VOLTS_OF_RANGE 10.0f /* V of the force's amplifier at 3.3 V */

enum { RECEIVED = 256, SENT = 512 };
static uint8_t received[RECEIVED];
static uint8_t to_send[SENT];
static uint32_t taken, first, behind;
static uint32_t tick;
static uint16_t count_before;
static int64_t counts;
static double beta; /* tracked */
static float omega, omega_dot;

static volatile uint32_t *at(uint32_t address) { return (volatile uint32_t *)address; }
enum {
  RCC = 0x40023800,
  GPIOA = 0x40020000,
  USART2 = 0x40004400,
  ADC1 = 0x40012000,
  DAC = 0x40007400,
  TIM3 = 0x40000400,
  TIM6 = 0x40001000,
  DMA1 = 0x40026000,
  IWDG = 0x40003000
};

static uint32_t received_so_far(void) { return (RECEIVED - *at(DMA1 + 0x8C)) % RECEIVED; }

void board_init(void) {
  *at(RCC + 0x30) |= (1u << 0) | (1u << 21);                          /* GPIOA, DMA1 */
  *at(RCC + 0x40) |= (1u << 1) | (1u << 4) | (1u << 17) | (1u << 29); /* TIM3, TIM6, USART2, DAC */
  *at(RCC + 0x44) |= 1u << 8;                                         /* ADC1 */
  (void)*at(RCC + 0x44);                                              /* the clocks run two cycles later */
  /* Both outputs to the middle before anything else. */
  *at(DAC + 0x08) = 2048u;
  *at(DAC + 0x14) = 2048u;
  *at(DAC + 0x00) = (1u << 0) | (1u << 16);
  /* PA0, PA1, PA4, PA5 analogue; PA2, PA3 USART2 (7); PA6, PA7 TIM3 (2), pulled up. PA13, PA14 stay the debugger's. */
  *at(GPIOA + 0x20) = (7u << 8) | (7u << 12) | (2u << 24) | (2u << 28);
  *at(GPIOA + 0x0C) |= (1u << 12) | (1u << 14);
  *at(GPIOA + 0x00) = (*at(GPIOA + 0x00) & 0xFFFF0000u) | 0xAFAFu;
  /* Serial line at 16 MHz; what comes in goes to memory by itself. */
  *at(USART2 + 0x08) = 139u; /* 115108 baud */
  *at(USART2 + 0x14) = 1u << 6;
  *at(DMA1 + 0x90) = USART2 + 4u;
  *at(DMA1 + 0x94) = (uint32_t)received;
  *at(DMA1 + 0x8C) = RECEIVED;
  *at(DMA1 + 0x88) = (4u << 25) | (1u << 10) | (1u << 8) | 1u; /* channel 4, memory goes on, in a circle */
  *at(USART2 + 0x0C) = (1u << 13) | (1u << 3) | (1u << 2);
  /* One conversion at a time, 144 cycles of sampling. */
  *at(ADC1 + 0x10) = (6u << 0) | (6u << 3);
  *at(ADC1 + 0x08) = 1u;
  /* Encoder: both edges of both tracks, filtered. */
  *at(TIM3 + 0x18) = (1u << 0) | (3u << 4) | (1u << 8) | (3u << 12);
  *at(TIM3 + 0x08) = 3u;
  *at(TIM3 + 0x2C) = 0xFFFFu;
  *at(TIM3 + 0x00) = 1u;
  /* 1 kHz. */
  *at(TIM6 + 0x28) = 15u;
  *at(TIM6 + 0x2C) = (uint32_t)(SAMPLE_TIME * 1e6) - 1u;
  *at(TIM6 + 0x00) = 1u;
  /* Resets the processor when the loop stands still for 50 ms: after that the outputs are not driven. */
  *at(IWDG) = 0x5555u;
  *at(IWDG + 4) = 0u;
  *at(IWDG + 8) = 400u;
  *at(IWDG) = 0xCCCCu;
}

static void send_waiting(void) {
  if ((first != behind) && ((*at(USART2) & (1u << 7)) != 0u)) {
    *at(USART2 + 4) = to_send[first];
    first = (first + 1u) % SENT;
  }
}

int board_get(void) {
  int byte = -1;
  send_waiting();
  if (taken != received_so_far()) {
    byte = received[taken];
    taken = (taken + 1u) % RECEIVED;
  }
  return byte;
}

/* What does not fit is lost: the host sees it by the CRC. */
void board_put(uint8_t byte) {
  const uint32_t next = (behind + 1u) % SENT;
  if (next != first) {
    to_send[behind] = byte;
    behind = next;
  }
}

static float displacement(uint32_t channel) {
  float current;
  *at(ADC1 + 0x34) = channel;
  *at(ADC1 + 0x00) = 0u;
  *at(ADC1 + 0x08) |= 1u << 30;
  while ((*at(ADC1) & 2u) == 0u) {
  }
  current = ((float)*at(ADC1 + 0x4C) * (3.3f / 4095.0f)) / (float)SHUNT_OHM;
  return ((current > 3.9e-3f) && (current < 20.1e-3f)) ? ((((current - 4e-3f) / 16e-3f) - 0.5f) * (float)RANGE_M) : NAN;
}

/* Angle, speed and acceleration from the counts: a filter with three equal poles. */
static void follow_encoder(void) {
  const float h = (float)SAMPLE_TIME;
  const uint16_t now = (uint16_t)*at(TIM3 + 0x24);
  double seen;
  float error;
  counts += (int16_t)(now - count_before);
  count_before = now;
  seen = (double)counts * (6.283185307179586 / COUNTS_PER_TURN);
  beta += (double)(h * (omega + (0.5f * h * omega_dot)));
  omega += h * omega_dot;
  error = (float)(seen - beta);
  beta += (double)(3.0f * TRACKING * h * error);
  omega += 3.0f * TRACKING * TRACKING * h * error;
  omega_dot += TRACKING * TRACKING * TRACKING * h * error;
}

bool board_read(board_sample *out) {
  if ((*at(TIM6 + 0x10) & 1u) == 0u) {
    return false;
  }
  *at(TIM6 + 0x10) = 0u;
  *at(IWDG) = 0xAAAAu;
  follow_encoder();
  out->tick = ++tick;
  out->x = displacement(0u);
  out->y = displacement(1u);
  out->beta = beta;
  out->omega = omega;
  out->omega_dot = omega_dot;
  out->done = false;
  return true;
}

static uint32_t code(float volts) {
  const float part = 0.5f + (volts / (2.0f * VOLTS_OF_RANGE));
  return (part > 0.0f) ? ((part < 1.0f) ? (uint32_t)((part * 4095.0f) + 0.5f) : 4095u) : 0u;
}

void board_write(uint32_t at_tick, float x_volts, float y_volts, bool armed, bool start) {
  (void)at_tick;
  (void)start;
  *at(DAC + 0x08) = armed ? code(x_volts) : 2048u;
  *at(DAC + 0x14) = armed ? code(y_volts) : 2048u;
}
