#ifndef WHIRL_START_H
#define WHIRL_START_H
#include <stdint.h>

void reset(void);
/* Text and numbers on the host's standard output. */
void print_text(const char *text);
void print_number(uint32_t value);
/* Ends the emulation with this exit code. */
void finish(uint32_t code);

#endif
