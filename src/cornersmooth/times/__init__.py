"""How long programs take: as written, of every form, in every setup; every time of an NC program comes from here."""
