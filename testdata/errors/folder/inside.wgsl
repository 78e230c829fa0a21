// Only here so that the folder exists.
