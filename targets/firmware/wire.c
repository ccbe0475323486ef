#include "wire.h"

#include <string.h>

/* CRC-16/CCITT-FALSE. */
static uint16_t crc16(const uint8_t *bytes, uint32_t size) {
  uint16_t crc = 0xFFFFu;
  uint32_t i;
  int bit;
  for (i = 0; i < size; i++) {
    crc = (uint16_t)(crc ^ (uint16_t)(bytes[i] << 8));
    for (bit = 0; bit < 8; bit++) {
      crc = ((crc & 0x8000u) != 0u) ? (uint16_t)((crc << 1) ^ 0x1021u) : (uint16_t)(crc << 1);
    }
  }
  return crc;
}

/* Length of the message that begins with these bytes; 0: none does, 1: too few to tell. */
static uint32_t length_of(const uint8_t *bytes, uint32_t count) {
  static const char magic[4][5] = {"WHC1", "WHR1", "WHP1", "WHA1"};
  static const uint32_t length[4] = {WIRE_COMMAND, WIRE_READING, WIRE_PARAMETER, WIRE_ANSWER};
  const uint32_t known = (count < 4u) ? count : 4u;
  int i;
  for (i = 0; i < 4; i++) {
    if (memcmp(bytes, magic[i], known) == 0) {
      return (known < 4u) ? 1u : length[i];
    }
  }
  return 0u;
}

static void drop_one(wire_input *in) {
  do {
    in->count--;
    memmove(in->bytes, &in->bytes[1], in->count);
  } while ((in->count > 0u) && (length_of(in->bytes, in->count) == 0u));
}

uint32_t wire_take(wire_input *in, uint8_t byte) {
  in->bytes[in->count++] = byte;
  while (in->count > 0u) {
    const uint32_t length = length_of(in->bytes, in->count);
    uint16_t crc;
    if (length == 0u) {
      drop_one(in);
      continue;
    }
    if ((length == 1u) || (in->count < length + 2u)) {
      return 0u;
    }
    crc = (uint16_t)(in->bytes[length] | (in->bytes[length + 1u] << 8));
    if (crc16(in->bytes, length) == crc) {
      in->count = 0u;
      return length;
    }
    drop_one(in); /* a magic word by chance, or a byte lost: look on behind it */
  }
  return 0u;
}

void wire_send(void (*put)(uint8_t), const uint8_t *message, uint32_t size) {
  const uint16_t crc = crc16(message, size);
  uint32_t i;
  for (i = 0; i < size; i++) {
    put(message[i]);
  }
  put((uint8_t)crc);
  put((uint8_t)(crc >> 8));
}

uint32_t wire_get32(const uint8_t *at) {
  uint32_t value;
  memcpy(&value, at, sizeof value);
  return value;
}

void wire_put32(uint8_t *at, uint32_t value) { memcpy(at, &value, sizeof value); }

double wire_get_double(const uint8_t *at) {
  double value;
  memcpy(&value, at, sizeof value);
  return value;
}

void wire_put_double(uint8_t *at, double value) { memcpy(at, &value, sizeof value); }
