#include <filiform.h>

#include <stdio.h>

int main(void) {
  filiform_set *set = NULL;
  if (filiform_open("/nowhere.fil", NULL, &set) == FILIFORM_OK) return 1;
  printf("%s: %s\n", filiform_version(), filiform_error_text());
  return 0;
}
