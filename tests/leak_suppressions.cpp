// CLN keeps a few bytes for the life of the program, which LeakSanitizer reports as lost. Linked into the programs of a
// sanitized build only.
extern "C" const char* __lsan_default_suppressions() { return "leak:libcln\n"; }
