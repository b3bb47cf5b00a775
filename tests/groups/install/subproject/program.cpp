#include <filiform/index/query/nearest.h>

int main() {
  try {
    throw filiform::UsageError("caught by the root of errors");
  } catch (const filiform::Error&) {
  }
}
