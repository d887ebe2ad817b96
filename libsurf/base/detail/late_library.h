// Libraries of the project that are loaded when they are first needed: surf_dicom (GDCM, DCMTK),
// surf_vtk (VTK's XML files) and surf_render (VTK's drawing). What they bring with them at a
// program's start is paid where it is used (docs/performance.md).
#pragma once

#include <string>

namespace surf {

/// The address of a variable in lib<library>.so.VERSION, which is beside the library surf; it stays
/// loaded. Use SURF_LATE.
/// @throws Error  it is not there, cannot be loaded, or has no such variable
const void* late_symbol(const std::string& library, const std::string& symbol);

template <class T>
const T& late(const char* library, const char* symbol) {
  return *static_cast<const T*>(late_symbol(library, symbol));
}

}  // namespace surf

/// The variable, a pointer to a function, of a late library; it is declared as extern "C". Static
/// builds link it.
#ifdef SURFSEG_STATIC
#define SURF_LATE(library, symbol) (symbol)
#else
#define SURF_LATE(library, symbol) (surf::late<decltype(symbol)>(#library, #symbol))
#endif
