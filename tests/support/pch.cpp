// The precompiled headers need one source file; see CMakeLists.txt.
