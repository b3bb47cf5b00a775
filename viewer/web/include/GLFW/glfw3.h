// GLFW of a browser (emscripten's), with stand-ins for the functions that it lacks.
#pragma once

#define GLFW_INCLUDE_NONE  // include/epoxy/gl.h has OpenGL
#include_next <GLFW/glfw3.h>

#define GLFW_SCALE_TO_MONITOR 0x0002200C

namespace filiform::web {

// CSS pixels to pixels of the screen.
void contentScale(GLFWwindow* window, float* across, float* down);
// What the pressed key types on this keyboard, in lower case.
const char* keyName(int key, int scancode);
// Not nullptr: the page is shown on the whole screen.
GLFWmonitor* windowMonitor(GLFWwindow* window);
void setWindowMonitor(GLFWwindow* window, GLFWmonitor* monitor, int x, int y, int width, int height, int rate);
GLFWmonitor* primaryMonitor();
const GLFWvidmode* videoMode(GLFWmonitor* monitor);
void setContentScaleCallback(GLFWwindow* window, void (*called)(GLFWwindow*, float, float));
// emscripten's callback gets pixels downwards. Here the page tells of notches, see scroll().
void setScrollCallback(GLFWwindow* window, void (*called)(GLFWwindow*, double, double));
void scroll(double notches);  // upwards; may be a fraction
// The browser may refuse it, for example without a click or key before.
void setClipboardString(GLFWwindow* window, const char* text);
// Returns at once: a page has its own loop.
void waitEventsTimeout(double wait_s);

}  // namespace filiform::web

#define glfwGetWindowContentScale filiform::web::contentScale
#define glfwGetKeyName filiform::web::keyName
#define glfwGetWindowMonitor filiform::web::windowMonitor
#define glfwSetWindowMonitor filiform::web::setWindowMonitor
#define glfwGetPrimaryMonitor filiform::web::primaryMonitor
#define glfwGetVideoMode filiform::web::videoMode
#define glfwSetWindowContentScaleCallback filiform::web::setContentScaleCallback
#define glfwSetScrollCallback filiform::web::setScrollCallback
#define glfwSetClipboardString filiform::web::setClipboardString
#define glfwWaitEventsTimeout filiform::web::waitEventsTimeout
