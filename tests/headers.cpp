// The headers that are precompiled for the tests stand in CMakeLists.txt.
