"""Every option of the command line, once: one module a kind; commands pick what they need."""
