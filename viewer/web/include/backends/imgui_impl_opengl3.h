// Dear ImGui's shaders for WebGL 2, whatever version the window asks for.
#pragma once

#include_next <backends/imgui_impl_opengl3.h>

#define ImGui_ImplOpenGL3_Init(version) ImGui_ImplOpenGL3_Init("#version 300 es")
