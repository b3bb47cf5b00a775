// SPDX-License-Identifier: MIT
//
// Functions of a vendor's library that is opened at run time, so that a bridge compiles without it.
#pragma once

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
