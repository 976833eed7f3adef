"""Several machines on one: hosts from namespaces, links to cut, what users do with them."""
