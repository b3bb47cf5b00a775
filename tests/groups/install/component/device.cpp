#include <filiform/device/factory/device_factory.h>

#include <iostream>

int main() {
  std::cout << filiform::deviceChoices() << '\n';
  const auto device = filiform::makeDevice("sim:medium");
  device->open();
  std::cout << toString(device->exchange({}).status) << '\n';
  device->close();
  try {  // libusb is linked
    filiform::makeDevice("spacemouse")->open();
  } catch (const filiform::Error& error) {
    std::cout << error.what() << '\n';
  }
}
