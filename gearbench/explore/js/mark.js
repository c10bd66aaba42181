// Move the line at the mesh phase; the server need not know.
mark.setv({ location: cb_obj.value }, { sync: false });
