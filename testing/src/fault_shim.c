/* Loaded with LD_PRELOAD in front of the C library: makes the n-th output call of a program fail, as a full or broken disk,
   a signal or a kill would. The program under test knows nothing of it.

     WHIRL_FAULT=KIND:N   KIND: enospc, eio     the n-th write and all later ones fail
                                eintr           every write fails once with EINTR before it works
                                short           every write takes one byte at first
                                kill            SIGKILL at the n-th write
                                fsync, rename   the n-th such call fails with EIO
                                memory          the n-th allocation of 64 KiB or more returns null
     WHIRL_FAULT_COUNT=FILE   appends one line "writes fsyncs renames allocations" at the end, to know how far n goes

   Only files count: not standard output and error, whose failure is another test. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { NOTHING, ENOSPC_, EIO_, EINTR_, SHORT_, KILL_, FSYNC_, RENAME_, MEMORY_ };
static int kind = -1;
static long at, writes, syncs, renames, allocations;

__attribute__((constructor)) static void start(void) {
  static const char *const names[] = {"", "enospc", "eio", "eintr", "short", "kill", "fsync", "rename", "memory"};
  const char *const text = getenv("WHIRL_FAULT");
  const char *const colon = text != NULL ? strchr(text, ':') : NULL;
  kind = NOTHING;
  if (colon == NULL) return;
  at = atol(colon + 1);
  for (int i = 1; i <= MEMORY_; ++i) {
    if (strlen(names[i]) == (size_t)(colon - text) && strncmp(names[i], text, strlen(names[i])) == 0) kind = i;
  }
}

__attribute__((destructor)) static void finish(void) {
  const char *const file = getenv("WHIRL_FAULT_COUNT");
  FILE *const out = file != NULL ? fopen(file, "a") : NULL;
  if (out == NULL) return;
  kind = NOTHING;
  fprintf(out, "%ld %ld %ld %ld\n", writes, syncs, renames, allocations);
  fclose(out);
}

/* 0: go on; 1: go on with one byte; -1: fail with errno. */
static int before_write(int fd, size_t size) {
  static __thread int interrupted;
  if (kind < 0) start();
  if (fd <= 2 || size == 0) return 0;
  if (kind == EINTR_) {
    interrupted = !interrupted;
    errno = EINTR;
    return interrupted ? -1 : 0;
  }
  const long n = __sync_add_and_fetch(&writes, 1);
  if (kind == SHORT_) return size > 1 && n % 2 == 1 ? 1 : 0;
  if (kind == KILL_ && n == at) kill(getpid(), SIGKILL);
  if ((kind == ENOSPC_ || kind == EIO_) && n >= at) {
    errno = kind == EIO_ ? EIO : ENOSPC;
    return -1;
  }
  return 0;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int fd, const void *from, size_t size) {
  static ssize_t (*real)(int, const void *, size_t);
  if (real == NULL) real = REAL(write);
  const int now = before_write(fd, size);
  return now < 0 ? -1 : real(fd, from, now > 0 ? 1 : size);
}

ssize_t pwrite(int fd, const void *from, size_t size, off_t offset) {
  static ssize_t (*real)(int, const void *, size_t, off_t);
  if (real == NULL) real = REAL(pwrite);
  const int now = before_write(fd, size);
  return now < 0 ? -1 : real(fd, from, now > 0 ? 1 : size, offset);
}

ssize_t pwrite64(int fd, const void *from, size_t size, off64_t offset) {
  static ssize_t (*real)(int, const void *, size_t, off64_t);
  if (real == NULL) real = REAL(pwrite64);
  const int now = before_write(fd, size);
  return now < 0 ? -1 : real(fd, from, now > 0 ? 1 : size, offset);
}

ssize_t writev(int fd, const struct iovec *parts, int count) {
  static ssize_t (*real)(int, const struct iovec *, int);
  if (real == NULL) real = REAL(writev);
  const int now = before_write(fd, 2);
  return now < 0 ? -1 : real(fd, parts, count);
}

int fsync(int fd) {
  static int (*real)(int);
  if (real == NULL) real = REAL(fsync);
  if (kind < 0) start();
  if (__sync_add_and_fetch(&syncs, 1) == at && kind == FSYNC_) return errno = EIO, -1;
  return real(fd);
}

int rename(const char *from, const char *to) {
  static int (*real)(const char *, const char *);
  if (real == NULL) real = REAL(rename);
  if (kind < 0) start();
  if (__sync_add_and_fetch(&renames, 1) == at && kind == RENAME_) return errno = EIO, -1;
  return real(from, to);
}

extern void *__libc_malloc(size_t size);
void *malloc(size_t size) {
  if (size >= 65536 && kind == MEMORY_ && __sync_add_and_fetch(&allocations, 1) == at) return errno = ENOMEM, NULL;
  if (size >= 65536 && kind != MEMORY_) __sync_add_and_fetch(&allocations, 1);
  return __libc_malloc(size);
}
