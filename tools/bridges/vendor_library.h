// SPDX-License-Identifier: MIT
//
// Functions of a vendor's library that is opened at run time, so that a bridge compiles without it; and the orientation
// of a stylus, which these libraries give as a matrix.
#pragma once

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Reads "[--device NAME] [ADDRESS]"; what is absent becomes NULL. Returns 0, and prints the usage, for other arguments.
static inline int read_arguments(int argc, char** argv, const char** device, const char** address) {
  int i = 1;
  *device = *address = NULL;
  if (argc > 2 && strcmp(argv[1], "--device") == 0) {
    *device = argv[2];
    i = 3;
  }
  if (i < argc && argv[i][0] != '-') *address = argv[i++];
  if (i < argc) fprintf(stderr, "usage: %s [--device NAME] [PATH | udp:127.0.0.1:PORT]\n", argv[0]);
  return i >= argc;
}

// Opens the library that the variable names, or `usual`. NULL, and a line on stderr, if it cannot be opened.
static inline void* open_library(const char* variable, const char* usual) {
  const char* const named = getenv(variable);
  const char* const file = named != NULL && named[0] != 0 ? named : usual;
  void* const library = dlopen(file, RTLD_NOW);
  if (library == NULL)
    fprintf(stderr, "bridge: %s: install the vendor's library, or name it in %s\n", dlerror(), variable);
  return library;
}

// Copies the address of a function to `function`, a pointer to a pointer of a function. Returns 0, and prints a line,
// if the library has none.
static inline int find_function(void* library, const char* name, void* function) {
  void* const found = dlsym(library, name);
  memcpy(function, &found, sizeof found);
  if (found == NULL) fprintf(stderr, "bridge: the vendor's library has no function %s\n", name);
  return found != NULL;
}

// The quaternion x y z w of a rotation matrix.
static inline void to_quaternion(const double m[3][3], double q[4]) {
  // From the greatest of the four components: no division by a small number.
  const double four[4] = {1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2],
                          1 - m[0][0] - m[1][1] + m[2][2], 1 + m[0][0] + m[1][1] + m[2][2]};
  int i, most = 3;
  double twice;
  for (i = 0; i < 3; ++i)
    if (four[i] > four[most]) most = i;
  twice = 2 * sqrt(four[most]);
  if (most == 3) {
    for (i = 0; i < 3; ++i) q[i] = (m[(i + 2) % 3][(i + 1) % 3] - m[(i + 1) % 3][(i + 2) % 3]) / twice;
    q[3] = twice / 4;
  } else {
    const int j = (most + 1) % 3, k = (most + 2) % 3;
    q[most] = twice / 4;
    q[j] = (m[most][j] + m[j][most]) / twice;
    q[k] = (m[most][k] + m[k][most]) / twice;
    q[3] = (m[k][j] - m[j][k]) / twice;
  }
}
