/* Messages of the board protocol on a serial line (docs/formats.md): the bytes of the datagram, then their CRC-16. */
#ifndef WHIRL_WIRE_H
#define WHIRL_WIRE_H
#include <stdbool.h>
#include <stdint.h>

enum { WIRE_COMMAND = 32, WIRE_READING = 72, WIRE_PARAMETER = 20, WIRE_ANSWER = 24, WIRE_LONGEST = 74 };

/* Bytes of a line put together to messages. Starts as zeros. */
typedef struct {
  uint8_t bytes[WIRE_LONGEST];
  uint32_t count;
} wire_input;

/* Takes one byte; the length of the message in `bytes` when it completes one whose CRC is right, else 0. What is no message is
   dropped up to the next magic word. */
uint32_t wire_take(wire_input *in, uint8_t byte);
/* Sends a message of `size` bytes with its CRC. */
void wire_send(void (*put)(uint8_t), const uint8_t *message, uint32_t size);

uint32_t wire_get32(const uint8_t *at);
void wire_put32(uint8_t *at, uint32_t value);
double wire_get_double(const uint8_t *at);
void wire_put_double(uint8_t *at, double value);

#endif
