extern "C" int foreign() { return 0; }
