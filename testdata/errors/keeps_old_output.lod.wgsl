// Written when the shader was still whole: it must survive.
